"""What pushes the vessel without being logged, and drifts of its sensors, as shapes of the predictions' errors.

A run from one first state adds up everything that pushed the vessel and that no model says: gusts, waves, an order that
came a millisecond before its log. Each window is divided into blocks; in each, u, v and r may have jumped, and position
and heading may stand off. Jumps are white or correlated over some seconds, what stands off over longer (first-order
Gauss-Markov). How large they are, the errors themselves tell (``identify.disturbance``); what they move the
parameters by follows from the same derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from identify import kernel
from identify.compiled import no_sensors, nothing_along, rows_of, sensing_of
from identify.drive import Drive, drive
from identify.predict import run
from identify.true_motion import through_water

if TYPE_CHECKING:
    from identify.structure import Structure
    from identify.windows import Problem, Window

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A block is about so long, s; a window has no fewer and no more of them than this.
BLOCK, FEWEST, MOST = 4.0, 4, 16
#: Directions in which a vessel is pushed, and in which position and heading stand off.
PUSHED, STANDS = 3, 3
#: Which size of a drift each of the latter has: a position's north and east, a heading's its own.
SIZE_OF = (0, 0, 1)


@dataclass(frozen=True)
class Sizes:
    """How large disturbances are.

    Attributes
    ----------
    push : (3,)
        Of the acceleration of u, v, r: standard deviation, m/s² and rad/s², or its white intensity times √s.
    push_time : float
        Its time constant, s; 0 for white.
    drift : (2,)
        Standard deviation of the position's drift, m, and of the heading's, rad.
    drift_time : float
        Their time constant, s.
    """

    push: FloatArray
    push_time: float
    drift: FloatArray
    drift_time: float


@dataclass(frozen=True)
class Disturbed:
    """Disturbances of some sizes, and what they make of a fit.

    Attributes
    ----------
    sizes : Sizes
    varied : (w, 8 + np, 8 + np)
        Covariance of the scores of every window's first state and of the parameters under them.
    left : (4,)
        How many times larger than white noise each stream's errors still are without them, slowly averaged.
    """

    sizes: Sizes
    varied: FloatArray
    left: FloatArray


def blocks_in(problem: Problem) -> int:
    """Blocks in every window."""
    longest = max(w.steps * problem.stretches[w.stretch].h for w in problem.windows)
    return int(np.clip(round(longest / BLOCK), FEWEST, MOST))


def sized(problem: Problem, sizes: Sizes, unit: tuple[FloatArray, ...]) -> tuple[FloatArray, ...]:
    """Per stretch (m, 2, K): what its samples show of disturbances of these sizes, from ``unit_answers``."""
    count = unit[0].shape[3]
    roots = roots_of(problem, count, sizes.push_time, sizes.drift_time)
    scale = np.append(sizes.push, sizes.drift[list(SIZE_OF)])
    answers = [np.zeros((*a.shape[:2], a.shape[2] * count)) for a in unit]
    for root, w in zip(roots, problem.windows, strict=True):
        mine = np.einsum("madb,dbc->madc", unit[w.stretch][w.samples], root * scale[:, None, None])
        answers[w.stretch][w.samples] = mine.reshape(*mine.shape[:2], -1)
    return tuple(answers)


def pushed_by(
    problem: Problem, structure: Structure, p: FloatArray, sizes: Sizes
) -> tuple[FloatArray, ...] | None:
    """Per stretch (m, 2, K): what its samples show of disturbances of these sizes, about the smoothed motion's windows.

    None where a prediction runs away.
    """
    drives = [drive(structure, p, s) for s in problem.stretches]
    first = np.zeros((len(problem.windows), kernel.NX))
    for k, w in enumerate(problem.windows):
        stretch, d = problem.stretches[w.stretch], drives[w.stretch]
        first[k, :6] = through_water(stretch.states[w.first : w.first + 1], d.current)[0]
    unit = unit_answers(problem, structure, drives, first, blocks_in(problem))
    return None if unit is None else sized(problem, sizes, unit)


def roots_of(problem: Problem, count: int, push_time: float, drift_time: float) -> FloatArray:
    """Roots (w, 6, count, count) of the covariance of the jumps and of what stands off, of unit size each."""
    lengths = np.array([w.steps * problem.stretches[w.stretch].h / count for w in problem.windows])
    out = np.empty((len(lengths), PUSHED + STANDS, count, count))
    out[:, :PUSHED] = (_root(lengths, count, push_time) * _jump(lengths, push_time)[:, None, None])[:, None]
    out[:, PUSHED:] = _root(lengths, count, drift_time)[:, None]
    return out


def _jump(lengths: FloatArray, time: float) -> FloatArray:
    """How far a velocity jumps in blocks of these lengths (w,) under an acceleration of unit size."""
    return np.asarray(lengths if time > 0.0 else np.sqrt(lengths))


def _root(lengths: FloatArray, count: int, time: float) -> FloatArray:
    """Root (w, count, count) of the correlation of blocks of these lengths."""
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    if not time > 0.0:
        return np.broadcast_to(np.eye(count), (len(lengths), count, count))
    shape = np.exp(-lengths[:, None, None] * apart / time) + 1e-9 * np.eye(count)
    return np.asarray(np.linalg.cholesky(shape), dtype=float)


def unit_answers(
    problem: Problem, structure: Structure, drives: list[Drive], first: FloatArray, count: int
) -> tuple[FloatArray, ...] | None:
    """Per stretch (m, 2, 6, count): what its samples show of a jump by one and of a sensor off by one in each block.

    ``first`` (w, 8) are the windows' first states. None where a prediction runs away.
    """
    out = []
    for number, d in enumerate(drives):
        windows = [(k, w) for k, w in enumerate(problem.windows) if w.stretch == number]
        found = _of_stretch(problem, structure, d, number, windows, first, count)
        if found is None:
            return None
        out.append(found)
    return tuple(out)


def _of_stretch(
    problem: Problem, structure: Structure, d: Drive, number: int, windows: list[tuple[int, Window]],
    first: FloatArray, count: int,
) -> FloatArray | None:  # fmt: skip
    stretch = problem.stretches[number]
    answers = np.zeros((len(stretch.samples.t), 2, PUSHED + STANDS, count))
    if not windows:
        return answers
    paths = [run(structure, d, stretch, first[k], w.first, w.steps) for k, w in windows]
    if not all(np.isfinite(path).all() for path in paths):
        return None
    sensing = sensing_of(np.ones(4), stretch, d.sensor, no_sensors(kernel.NX))
    for b in range(count):
        places = [min(round((b + 0.5) * w.steps / count), w.steps - 1) for _, w in windows]
        states = np.array([path[at] for path, at in zip(paths, places, strict=True)])
        parts = [_rest(problem, w, at) for (_, w), at in zip(windows, places, strict=True)]
        answers[:, :, :PUSHED, b] = rows_of(
            structure, d, stretch, parts, states, nothing_along(kernel.NX), sensing, slice(3, 6)
        )
    answers[:, :, :PUSHED] *= stretch.samples.sigma[:, None, None, None]
    _stand_off(problem, [w for _, w in windows], answers)
    return answers


def _rest(problem: Problem, window: Window, after: int) -> Window:
    """A window from some steps after its begin on."""
    stretch = problem.stretches[window.stretch]
    samples, begin = window.samples, stretch.start + stretch.h * (window.first + after)
    low = samples.start + int(np.searchsorted(stretch.samples.taken[samples], begin))
    return replace(
        window, first=window.first + after, steps=window.steps - after, samples=slice(low, samples.stop)
    )


def _stand_off(problem: Problem, windows: list[Window], answers: FloatArray) -> None:
    """Put in where positions stand off by one, north and east, and headings, in the middle of each block.

    Between the middles a drift is on a line: in blocks that jump what moves a vessel smoothly would be preferred to it.
    """
    count = answers.shape[3]
    for w in windows:
        stretch = problem.stretches[w.stretch]
        since = (stretch.samples.t[w.samples] - stretch.start) / stretch.h - w.first
        place = np.clip(since * count / w.steps - 0.5, 0.0, count - 1.0)
        weights = np.maximum(1.0 - np.abs(place[:, None] - np.arange(count)), 0.0)
        for kind, axis, stands in ((kernel.POSITION, 0, 0), (kernel.POSITION, 1, 1), (kernel.HEADING, 0, 2)):
            at = np.nonzero(problem.kinds(w) == kind)[0]
            answers[w.samples.start + at, axis, PUSHED + stands] = weights[at]
