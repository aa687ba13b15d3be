"""The search for a hull, a current, offsets of clocks and the sensors' own errors that leave nothing but noise.

The hull (``preprocess.hull_run``) is run freely through windows, each from a first state of its own, and held against
the samples of position, heading and yaw rate in units of their noise (an output error by multiple shooting, Bock and
Plitt 1984): short windows first, so that a search which begins anywhere arrives. Damped Gauss-Newton steps; what is
left of a stream beyond its noise makes the stream count less. A weak prior of the natural size of each coefficient
keeps those that the motion does not determine; so do priors of an antenna elsewhere than declared and of a compass that
is turned, which look like stamps that are late where the terms do not follow them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from preprocess.hull_data import SHOWN, Acting, Seen, forces
from preprocess.hull_run import BEYOND, PER_INPUT, STATE, TERMS, free_terms, put_between, sail
from preprocess.kalman import IntArray
from preprocess.trial import FloatArray

#: Unknowns behind those of the run: the offset of the position; the gyro's scale, bias and offset; where the antenna
#: is, forward and to starboard of where it is said to be, and how far the compass is turned.
OFF, SCALE, BIAS, SHIFT, AHEAD, ABEAM, TURNED, MORE = 0, 1, 2, 3, 4, 5, 6, 7
#: Steps of one search, dampings that are tried for one of them, the longest step in an offset, s.
STEPS, DAMPINGS, LARGE = 40, 7, 0.2
#: A gain in -2 log likelihood that ends a search; of one that is followed by another one.
LEAST_GAIN, ROUGH_GAIN = 0.05, 2.0
#: A run that ends beyond this, in any unit, has no end.
BEYOND_ALL = 1e8


@dataclass(frozen=True)
class Window:
    """One window: start, step, s; number of steps; and per sensor the samples in it."""

    start: float
    step: float
    count: int
    samples: tuple[Seen, ...]

    @property
    def edges(self) -> FloatArray:
        """Times of the states, (count + 1,) s."""
        return np.asarray(self.start + self.step * np.arange(self.count + 1), float)


@dataclass(frozen=True)
class Guess:
    """Unknowns: coefficients (3, k), inputs' offset, current, position's offset, the gyro's three, three of mounting.

    ``firsts`` (windows, 6) are the states at the start of the windows.
    """

    theta: FloatArray
    late: float
    current: FloatArray
    off: float
    gyro: FloatArray
    mounting: FloatArray
    firsts: FloatArray

    def moved(self, step: FloatArray) -> Guess:
        """The guess after a step of all unknowns, those of the windows last."""
        equation, term = free_terms(_inputs(self.theta))
        p, theta = len(equation), self.theta.copy()
        theta[equation, term] += step[:p]
        late, off = np.clip(step[[p, p + BEYOND + OFF]], -LARGE, LARGE)
        gyro, mounting, firsts = np.split(step[p + BEYOND + SCALE :], (AHEAD - SCALE, MORE - SCALE))
        return Guess(
            theta, self.late + float(late), self.current + step[p + 1 : p + BEYOND], self.off + float(off),
            self.gyro + gyro, self.mounting + mounting, self.firsts + firsts.reshape(-1, STATE),
        )  # fmt: skip


def _inputs(theta: FloatArray) -> int:
    return (theta.shape[1] - TERMS) // PER_INPUT


@dataclass(frozen=True)
class Left:
    """What a guess leaves in the windows, in units of the noise.

    ``errors`` and ``slopes`` (rows, globals + 6) of each window, ``t`` and ``stream`` of each row.
    """

    errors: list[FloatArray]
    slopes: list[FloatArray]
    t: list[FloatArray]
    stream: list[FloatArray]

    def spread(self, number: int) -> float:
        """Root mean square of what is left of a stream."""
        e = np.concatenate([x[k == number] for x, k in zip(self.errors, self.stream, strict=True)])
        return float(np.sqrt(np.mean(e**2))) if len(e) else 1.0


@dataclass(frozen=True)
class Problem:
    """Windows, inputs, weights (standard deviations of the streams are multiplied by them), and priors.

    ``prior`` (p,) of the coefficients, ``mounting`` (3,) of antenna and compass, as one over a standard deviation;
    ``held`` are places of unknowns, among all, that stay as they are.
    """

    windows: Sequence[Window]
    inputs: Sequence[Acting]
    weights: FloatArray
    prior: FloatArray
    mounting: FloatArray = field(default_factory=lambda: np.zeros(MORE - AHEAD))
    held: tuple[int, ...] = ()


def cut_windows(
    bounds: Sequence[tuple[float, float]], step: float, streams: Sequence[Seen], off: float
) -> tuple[Window, ...]:
    """Windows with the samples in them; the positions' by stamps moved back by ``off``."""
    out = []
    for a, b in bounds:
        count = max(int(np.ceil((b - a) / step)), 2)
        inner = []
        for s in streams:
            stamp = s.t - (off if s.name == "position" else 0.0)
            use = (stamp >= a) & (stamp < b)
            inner.append(Seen(s.name, s.t[use], s.value[use], s.sigma[use]))
        out.append(Window(a, (b - a) / count, count, tuple(inner)))
    return tuple(out)


def left_by(problem: Problem, guess: Guess) -> Left | None:
    """Errors of all windows and their sensitivities; None where a run goes beyond all bounds."""
    parts = []
    for k in range(len(problem.windows)):
        part = _of_window(problem, guess, k)
        if part is None:
            return None
        parts.append(part)
    return Left(*(list(x) for x in zip(*parts, strict=True)))


def _of_window(
    problem: Problem, guess: Guess, number: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None:
    w = problem.windows[number]
    here, later = forces(problem.inputs, w.edges + guess.late)
    states, slopes = sail(guess.theta, guess.firsts[number], guess.current, here, later, w.step)
    if not (np.abs(states[-1]) < BEYOND_ALL).all() or not (np.abs(slopes[-1]) < BEYOND_ALL).all():
        return None
    rows = [
        _shown(w, s, column, c, states, slopes, guess, problem.weights[k])
        for k, s in enumerate(w.samples)
        for c, column in enumerate(SHOWN[s.name])
    ]
    which = [np.full(len(s.t), float(k)) for k, s in enumerate(w.samples) for _ in SHOWN[s.name]]
    stamps = [s.t for s in w.samples for _ in SHOWN[s.name]]
    errors, designs = zip(*rows, strict=True)
    return np.concatenate(errors), np.vstack(designs), np.concatenate(stamps), np.concatenate(which)


def _shown(
    w: Window,
    s: Seen,
    column: int,
    component: int,
    states: FloatArray,
    slopes: FloatArray,
    guess: Guess,
    weight: float,
) -> tuple[FloatArray, FloatArray]:
    """Errors of one component of one sensor, and their sensitivities, both over its noise."""
    stamp = s.t - {"position": guess.off, "yaw_rate": float(guess.gyro[2])}.get(s.name, 0.0)
    at = np.clip(((stamp - w.start) / w.step).astype(int), 0, w.count - 1)
    x = (stamp - w.start) / w.step - at
    value, rate = _between(states, guess.current, column, at, x, w.step)
    unit = 1.0 / (s.sigma * weight)
    shared, gain, turning = slopes.shape[2] - STATE, 1.0, np.empty(0)
    full = np.zeros((len(x), shared + MORE + STATE))
    if s.name == "position":
        psi = (1.0 - x) * states[at, 2] + x * states[at + 1, 2]
        along, swung = arms(psi, component)
        value, turning = value + along @ guess.mounting[:2], swung @ guess.mounting[:2]
        full[:, shared + AHEAD : shared + ABEAM + 1] = along * unit[:, None]
        full[:, shared + OFF] = (-rate - turning * (states[at + 1, 2] - states[at, 2]) / w.step) * unit
    if s.name == "heading":
        value, full[:, shared + TURNED] = value + guess.mounting[2], unit
    if s.name == "yaw_rate":
        gain = 1.0 + float(guess.gyro[0])
        full[:, shared + SCALE], full[:, shared + BIAS] = value * unit, unit
        full[:, shared + SHIFT] = -rate * unit
        value = gain * value + guess.gyro[1]
    put_between(slopes, column, at, x, turning, gain, unit, MORE, full)
    return (s.value[:, component] - value) * unit, full


def arms(psi: FloatArray, component: int) -> tuple[FloatArray, FloatArray]:
    """What an antenna forward and to starboard adds to north (0) or east (1), and its slope in ψ, (n, 2) each."""
    c, d = np.cos(psi), np.sin(psi)
    north, east = np.column_stack([c, -d]), np.column_stack([d, c])
    return (east, north) if component else (north, -east)


def _between(
    states: FloatArray, current: FloatArray, column: int, at: FloatArray, x: FloatArray, step: float
) -> tuple[FloatArray, FloatArray]:
    """Value and rate of a state between its steps: positions and angles by their rates at both ends, rates straight."""
    a, b = states[at, column], states[at + 1, column]
    if column > 2:
        return (1.0 - x) * a + x * b, (b - a) / step
    c, d = (_rate(states[k], current, column) for k in (at, at + 1))
    value = (1.0 + 2.0 * x) * (1.0 - x) ** 2 * a + x**2 * (3.0 - 2.0 * x) * b
    value += step * x * (1.0 - x) * ((1.0 - x) * c - x * d)
    rate = 6.0 * x * (x - 1.0) * (a - b) / step + (3.0 * x - 1.0) * (x - 1.0) * c + x * (3.0 * x - 2.0) * d
    return value, rate


def _rate(states: FloatArray, current: FloatArray, column: int) -> FloatArray:
    psi, u, v, r = states[:, 2:].T
    if column == 2:
        return np.asarray(r, float)
    c, d = np.cos(psi), np.sin(psi)
    return np.asarray(u * c - v * d + current[0] if column == 0 else u * d + v * c + current[1], float)


def normal(problem: Problem, guess: Guess, left: Left) -> tuple[FloatArray, FloatArray, float]:
    """Normal matrix, right side and -2 log likelihood with the prior; windows' first states last."""
    shared = left.slopes[0].shape[1] - STATE
    size, p = shared + STATE * len(left.slopes), len(problem.prior)
    matrix, side, cost = np.zeros((size, size)), np.zeros(size), 0.0
    for k, (e, d) in enumerate(zip(left.errors, left.slopes, strict=True)):
        place = place_of(shared, k)
        matrix[np.ix_(place, place)] += d.T @ d
        side[place] += d.T @ e
        cost += float(e @ e)
    coefficients = guess.theta[free_terms(len(problem.inputs))]
    known = np.r_[np.arange(p), p + BEYOND + np.arange(AHEAD, MORE)]
    weight, value = np.r_[problem.prior, problem.mounting] ** 2, np.r_[coefficients, guess.mounting]
    matrix[known, known] += weight
    side[known] -= weight * value
    for k in problem.held:
        matrix[k], matrix[:, k], side[k] = 0.0, 0.0, 0.0
        matrix[k, k] = 1.0
    return matrix, side, cost + float(weight @ value**2)


def place_of(shared: int, window: int) -> IntArray:
    """Where the unknowns of a window stand among all: those that all share, then its first state."""
    return np.asarray(np.r_[np.arange(shared), shared + STATE * window + np.arange(STATE)], np.int64)


def descend(problem: Problem, guess: Guess, least_gain: float) -> tuple[Guess, Left] | None:
    """Damped Gauss-Newton search from a guess; None where the guess cannot be sailed."""
    left, damping = left_by(problem, guess), 1e-3
    if left is None:
        return None
    matrix, side, cost = normal(problem, guess, left)
    for _ in range(STEPS):
        scale = np.sqrt(np.diag(matrix)) + 1e-12
        scaled, before = matrix / np.outer(scale, scale), cost
        for _ in range(DAMPINGS):
            step = np.linalg.solve(scaled + (damping + 1e-9) * np.eye(len(scaled)), side / scale) / scale
            if float(side @ step) < least_gain:  # no more is to be had
                return guess, left
            tried = guess.moved(step)
            found = left_by(problem, tried)
            new = None if found is None else normal(problem, tried, found)
            if found is not None and new is not None and new[2] < cost:
                guess, left, (matrix, side, cost) = tried, found, new
                damping = max(0.1 * damping, 1e-9)
                break
            damping *= 10.0
        if before - cost < least_gain:
            break
    return guess, left


def settle(
    problem: Problem, guess: Guess, rounds: int, least_gain: float
) -> tuple[Problem, Guess, Left] | None:
    """Search, with the streams' weights renewed between the rounds: none counts more than what it leaves allows."""
    found = None
    for k in range(rounds):
        found = descend(problem, guess, least_gain if k == rounds - 1 else ROUGH_GAIN)
        if found is None:
            return None
        guess, left = found
        if k < rounds - 1:
            spread = np.array([left.spread(i) for i in range(len(problem.weights))])
            problem = replace(problem, weights=np.maximum(problem.weights * spread, 1.0))
    return None if found is None else (problem, *found)
