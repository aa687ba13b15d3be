"""Sway and yaw that respond with time constants of their own, run freely through time, beside offsets of clocks.

    v̇ = -(k + k₁|v| + Σ κ w) v + columns · gains
    ṙ = -(k + k₁|r| + Σ κ w) r + c₁ v + c₂ u v + c₃ |v| v + columns · gains

All coefficients, the first values of every stretch and two offsets are free: that of the inputs, on which both depend,
and that of the position, from which the measured sway comes. The responses are run through from their first values (an
output error), so noise of measured velocities does not bias the time constants, for which an offset would have to make
up; and what sway does to the turning is seen by the more precise of the two sensors. Errors are compared as averages
over windows, below the frequencies that belong to the smoother and to the sensors' noise. ``preprocess.free_fit``
searches.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from preprocess.trial import FloatArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Smallest and largest rate, in units of one over the response time.
SLOWEST, FASTEST = 0.01, 30.0
#: Number of the offsets, of all that a pose depends on, and of the gains by which sway turns the vessel.
OFFSETS, POSED, COUPLED = 2, 4, 3
#: Steps by which sensitivities are found: of a current, m/s, and of an offset, as a share of the response time.
SMALL_CURRENT, SMALL_OFFSET = 0.01, 0.03
#: What is looked at: one of the two velocities, the yaw then beside the measured sway, or both.
SWAY, YAW, BOTH = 0, 1, 2


@dataclass(frozen=True)
class Stretch:
    """An unbroken stretch on an even grid: columns (n,) each, and windows of averages (k, n) about centres (k,)."""

    t: FloatArray
    columns: Mapping[str, FloatArray]
    windows: csr_matrix
    centres: FloatArray
    half: float


@dataclass(frozen=True)
class Driven:
    """A measured velocity (n,); per interval what drives it (n - 1, m) and what its rate depends on (n - 1, q).

    ``rest`` gives what the measured velocity has more than ``target`` in the windows (k,).
    """

    target: FloatArray
    columns: FloatArray
    weights: FloatArray
    rest: Callable[[], FloatArray] | None = None


@dataclass(frozen=True)
class Posed:
    """What a stretch is to show, through the water: sway, yaw, and the speed in the intervals (n - 1,)."""

    sway: Driven
    yaw: Driven
    speed: FloatArray


#: What a stretch is to show, for a current to north and east and the offsets of inputs and position, in turn.
Pose = Callable[[Stretch, FloatArray], Posed]


@dataclass(frozen=True)
class Guess:
    """Unknowns: rates and gains of sway and yaw, coupling, first values (2, stretches), current (2,), offsets (2,)."""

    sway: tuple[FloatArray, FloatArray]
    yaw: tuple[FloatArray, FloatArray]
    coupling: FloatArray
    first: FloatArray
    current: FloatArray
    offsets: FloatArray

    @property
    def parts(self) -> tuple[FloatArray, ...]:
        """All unknowns in turn, as they stand in a step."""
        return (*self.sway, *self.yaw, self.coupling, self.first.ravel(), self.current, self.offsets)

    @property
    def posed(self) -> FloatArray:
        """What a pose depends on: the current, then the offsets."""
        return np.concatenate([self.current, self.offsets])

    @property
    def places(self) -> list[slice]:
        """Where each part stands in a step."""
        ends = np.cumsum([p.size for p in self.parts])
        return [slice(int(b - p.size), int(b)) for p, b in zip(self.parts, ends, strict=True)]

    def moved(self, step: FloatArray) -> Guess:
        """The guess after a step of all unknowns."""
        ends = np.cumsum([p.size for p in self.parts])[:-1]
        a, b, c, d, e, f, g, h = (p + s for p, s in zip(self.parts, np.split(step, ends), strict=True))
        return Guess((a, b), (c, d), e, f.reshape(self.first.shape), g, h)


@dataclass(frozen=True)
class Problem:
    """Stretches of one grid interval, what they are to show, and the response time, roughly, s."""

    parts: Sequence[Stretch]
    pose: Pose
    time: float


Pair = tuple[FloatArray, FloatArray]
Several = tuple[FloatArray, ...]


@njit(cache=True)
def _run(y, rates, weights, force, step, slowest, fastest):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for i in range(len(force)):
        a = rates[0]
        for j in range(weights.shape[1]):
            a += rates[2 + j] * weights[i, j]
        ahead = y[i]
        for _ in range(2):
            own = min(max(a + rates[1] * 0.5 * (abs(y[i]) + abs(ahead)), slowest), fastest)
            keep = np.exp(-own * step)
            ahead = keep * y[i] + (1.0 - keep) / own * force[i]
        y[i + 1] = ahead


@njit(cache=True)
def _sense(decay, columns, step, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Responses (n, m) to columns (n - 1, m) at a decay (n - 1,) that varies, from the first row of ``out`` on."""
    for i in range(len(decay)):
        keep = np.exp(-decay[i] * step)
        gain = (1.0 - keep) / decay[i]
        for j in range(columns.shape[1]):
            out[i + 1, j] = keep * out[i, j] + gain * columns[i, j]


def middle(x: FloatArray) -> FloatArray:
    """Averages over the intervals between points, along the first axis."""
    return 0.5 * (x[1:] + x[:-1])


def errors_of(problem: Problem, guess: Guess, which: int, slopes: bool) -> tuple[Several, Several]:
    """Errors in all windows and their sensitivities to all unknowns, of sway, of yaw, or of one after the other.

    Parameters
    ----------
    which : int
        ``SWAY``, ``YAW`` or ``BOTH``.
    slopes : bool
        With the sensitivities to the current and the offsets; else those are zero.
    """
    out = [_of_stretch(problem, guess, k, which, slopes) for k in range(len(problem.parts))]
    number = len(out[0][0])
    errors = tuple(np.concatenate([o[0][i] for o in out]) for i in range(number))
    return errors, tuple(np.vstack([o[1][i] for o in out]) for i in range(number))


def _of_stretch(
    problem: Problem, guess: Guess, number: int, which: int, slopes: bool
) -> tuple[Several, Several]:
    s, place = problem.parts[number], guess.places
    posed = problem.pose(s, guess.posed)
    later = _later(problem, s, guess) if slopes else []
    none = np.zeros((len(s.t) - 1, place[-1].stop))
    first = place[5].start + number
    v, sv = posed.sway.target, np.zeros((len(s.t), none.shape[1]))
    shows = []
    if which != YAW:
        slope, at = none.copy(), (place[0], place[1], first)
        for k, (moved, small) in enumerate(later):
            slope[:, k - POSED] = _pushed(posed.sway, moved.sway, guess.sway) / small
        v, sv = _response(problem, s, posed.sway, guess.sway, none[:, 0], slope, guess.first[0, number], at)
    if which != SWAY:
        force, slope = _coupled(posed, guess, v, sv)
        for k, (moved, small) in enumerate(later):
            slope[:, k - POSED] += _pushed(posed.yaw, moved.yaw, guess.yaw) / small
        at = place[2], place[3], first + len(problem.parts)
        yaw = _response(problem, s, posed.yaw, guess.yaw, force, slope, guess.first[1, number], at)
        shows.append((posed.yaw, *yaw))
    if which != YAW:
        sv = sv.copy()
        for k, (moved, small) in enumerate(later):
            sv[:, k - POSED] -= (moved.sway.target - posed.sway.target) / small
        shows.insert(0, (posed.sway, v, sv))
    errors = tuple(
        np.asarray(s.windows.dot(d.target - y)) + (0.0 if d.rest is None else d.rest()) for d, y, _ in shows
    )
    return errors, tuple(np.asarray(s.windows.dot(x)) for _, _, x in shows)


def _later(problem: Problem, s: Stretch, guess: Guess) -> list[tuple[Posed, float]]:
    """The stretch with a little more of a current to the north, to the east, and of each offset; how much more."""
    steps = (SMALL_CURRENT, SMALL_CURRENT, *(SMALL_OFFSET * problem.time,) * OFFSETS)
    return [(problem.pose(s, guess.posed + x * row), x) for x, row in zip(steps, np.eye(POSED), strict=True)]


def _pushed(here: Driven, later: Driven, own: Pair) -> FloatArray:
    """How what drives a velocity differs between two poses, (n - 1,)."""
    rates, gains = own
    fading = (later.weights - here.weights) @ rates[2:] * middle(here.target)
    return np.asarray((later.columns - here.columns) @ gains - fading, float)


def _coupled(posed: Posed, guess: Guess, v: FloatArray, sv: FloatArray) -> Pair:
    """What sway does to the turning (n - 1,), and its sensitivities (n - 1, p)."""
    mean, c = middle(v), guess.coupling
    columns = np.column_stack([mean, posed.speed * mean, np.abs(mean) * mean])
    slope = (c[0] + c[1] * posed.speed + 2.0 * c[2] * np.abs(mean))[:, None] * middle(sv)
    slope[:, guess.places[4]] += columns
    return columns @ c, slope


def _response(
    problem: Problem,
    s: Stretch,
    driven: Driven,
    own: tuple[FloatArray, FloatArray],
    force: FloatArray,
    slope: FloatArray,
    first: float,
    place: tuple[slice, slice, int],
) -> Pair:
    """A velocity (n,) and its sensitivities (n, p), with what forces it beside its own columns and their slope."""
    rates, gains = own
    step, limits = float(s.t[1] - s.t[0]), (SLOWEST / problem.time, FASTEST / problem.time)
    y = np.zeros(len(s.t))
    y[0] = first
    _run(y, rates, driven.weights, driven.columns @ gains + force, step, *limits)
    mean = middle(y)
    terms = np.column_stack([np.ones(len(mean)), np.abs(mean), driven.weights])
    decay = np.clip(terms @ rates + rates[1] * np.abs(mean), *limits)
    columns = slope.copy()
    columns[:, place[0]] -= terms * mean[:, None]
    columns[:, place[1]] += driven.columns
    out = np.zeros((len(y), columns.shape[1]))
    out[0, place[2]] = 1.0
    _sense(decay, columns, step, out)
    return y, out
