"""A wander of the position, told from what a fit leaves of it, and what it does to the parameters.

The errors of a satellite's position drift (first-order Gauss-Markov). First states and parameters follow a drift as far
as they can, so what is left in the errors is smaller and quicker than the drift was. Here errors are averaged over
blocks of time, and size and time constant of the drift are those under which such averages, less what the fit took of
them, are likely (restricted likelihood). What the drift moves the parameters by follows from the same derivatives, each
size and time constant counted by its likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from identify import kernel
from identify.drift import Drift
from identify.kernel import NX
from identify.output_error import Solution
from identify.stretch import Stretch
from identify.windows import Problem, Window, moments, tangents_of

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Shortest block, s, and about how many there are (one for each window at least); so many tell size and time constant.
SHORTEST, MOST, TELLING = 1.0, 100, 250
#: Fewer blocks than this tell nothing.
FEWEST = 12
#: Time constants that are tried, s, and sizes, in units of the spread of the averages.
TIMES = np.array([2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
SIZES = np.geomspace(0.05, 20.0, 25)
#: Errors whose slow averages are less than this times those of white noise are not looked at.
QUIET = 1.1
#: A drift is there where the log likelihood is larger with it by this much.
GAIN = 3.0


@dataclass(frozen=True)
class _Blocks:
    """Averages of the position's error over blocks.

    ``window``, ``stretch``, ``t`` (b,) where and when; ``mean`` (b, 2) north and east; ``weight`` (b,) sum of the
    samples' weights; ``slope`` (b, 2, 8 + np) sums of the weighted derivatives by first state and parameters.
    """

    window: IntArray
    stretch: IntArray
    t: FloatArray
    mean: FloatArray
    weight: FloatArray
    slope: FloatArray

    def first(self, count: int) -> _Blocks:
        """No more than the first ones."""
        n = slice(count)
        return _Blocks(
            self.window[n], self.stretch[n], self.t[n], self.mean[n], self.weight[n], self.slope[n]
        )


@dataclass(frozen=True)
class Reduction:
    """How a fit answers to errors.

    ``states`` (w, 8, 8) inverse information of each window's first state, ``through`` (w, 8 + np, np) what of a window
    goes through to the parameters, ``inverse`` (np, np) their own inverse information.
    """

    states: FloatArray
    through: FloatArray
    inverse: FloatArray


def moved_by_wander(problem: Problem, solution: Solution, reduction: Reduction) -> FloatArray | None:
    """Covariance (np, np) of what a drift of the position moves parameters by; None where it is known or shows not."""
    seen = _seen(problem, solution, reduction)
    if seen is None:
        return None
    odds = np.exp(seen.chance - seen.chance.max())
    variance = (odds * seen.sizes**2).sum(axis=1) / odds.sum()
    flat = seen.through.reshape(-1, seen.through.shape[-1])
    moved = sum(v * (flat.T @ shape @ flat) for v, shape in zip(variance, seen.shapes, strict=True))
    return np.asarray(reduction.inverse @ moved @ reduction.inverse, dtype=float)


def likeliest_wander(problem: Problem, solution: Solution, reduction: Reduction) -> Drift | None:
    """The drift of the position that a fit's errors are likeliest with; None where it is known or shows not."""
    seen = _seen(problem, solution, reduction)
    if seen is None:
        return None
    time, size = np.unravel_index(int(np.argmax(seen.chance)), seen.chance.shape)
    return Drift(float(seen.sizes[size]), float(TIMES[time]), shown=True)


def gain_of_wander(problem: Problem, solution: Solution, reduction: Reduction) -> float:
    """What the likeliest drift of the position gains in 2 log likelihood over none, by a fit's errors; 0 without one.

    Where there are more averages than are looked at, as much by those.
    """
    seen = _seen(problem, solution, reduction)
    if seen is None:
        return 0.0
    return 2.0 * float(seen.chance.max()) * max(1.0, len(seen.through) / TELLING)


def drifts_shown(problem: Problem) -> tuple[Drift, ...]:
    """The drifts that the errors of a fit showed; those that were told otherwise are not among them."""
    return next((tuple(d for d in s.drifts if d.shown) for s in problem.stretches), ())


def wander_shown(problem: Problem) -> Drift | None:
    """The drift of the position that the errors of a fit showed; None where none is known, or it was told otherwise."""
    return next((d for d in drifts_shown(problem) if d.kind == kernel.POSITION), None)


def with_drifts(stretches: Sequence[Stretch], drifts: Sequence[Drift]) -> tuple[Stretch, ...]:
    """Stretches with drifts that errors showed in place of all that others did."""
    return tuple(replace(s, drifts=(*(d for d in s.drifts if not d.shown), *drifts)) for s in stretches)


def in_wander(problem: Problem, drift: Drift | None) -> tuple[Stretch, ...]:
    """Stretches with a drift of the position that errors showed, or none, in place of any that others did."""
    others = [d for d in drifts_shown(problem) if d.kind != kernel.POSITION]
    return with_drifts(problem.stretches, others if drift is None else [*others, drift])


@dataclass(frozen=True)
class _Seen:
    """How likely drifts of the position are, by their errors' averages over blocks.

    ``chance`` (t, k) log likelihood over that of none, by time constant and size; ``sizes`` (k,), m; ``shapes`` (2 b,
    2 b) the averages' covariance under a drift of a metre, by time constant; ``through`` (b, 2, np) what a metre in a
    block moves the parameters' score by.
    """

    chance: FloatArray
    sizes: FloatArray
    shapes: tuple[FloatArray, ...]
    through: FloatArray


def _seen(problem: Problem, solution: Solution, reduction: Reduction) -> _Seen | None:
    """What a fit's errors say of a drift of the position; None where it is known or shows not."""
    slow = float(problem.inflation[kernel.POSITION] * problem.dispersion[kernel.POSITION])
    blocks = None if problem.drifts or not slow > QUIET else _averaged(problem, solution)
    if blocks is None or len(blocks.t) < FEWEST:
        return None
    through = np.einsum("bac,bcn->ban", blocks.slope, reduction.through[blocks.window])
    left = _left_by_fit(blocks.first(TELLING), reduction, through[:TELLING])
    few = len(left)
    noise = 1.0 / np.sqrt(np.repeat(blocks.weight, 2)[:few]) / problem.inflation[kernel.POSITION]
    error = blocks.mean.ravel()[:few] / noise
    together = np.equal.outer(blocks.stretch, blocks.stretch)
    apart = np.abs(np.subtract.outer(blocks.t, blocks.t))
    sizes = SIZES * float(np.std(blocks.mean))
    decays = [np.where(together, np.exp(-apart / time), 0.0) for time in TIMES]
    shapes = tuple(np.asarray(np.kron(d, np.eye(2)), dtype=float) for d in decays)
    chance = []
    for shape in shapes:
        value, vector = np.linalg.eigh((left @ shape[:few, :few] @ left.T) / noise / noise[:, None])
        chance.append(_likelihood(np.maximum(value, 0.0), vector.T @ error, sizes))
    table = np.array(chance)
    return _Seen(table, sizes, shapes, through) if table.max() >= GAIN else None


def _likelihood(value: FloatArray, error: FloatArray, sizes: FloatArray) -> FloatArray:
    """Log likelihood (k,) of drifts of these sizes, over that of none."""
    grown = 1.0 + np.multiply.outer(sizes**2, value)
    return np.asarray(0.5 * np.sum(error**2 * (1.0 - 1.0 / grown) - np.log(grown), axis=1), dtype=float)


def _left_by_fit(blocks: _Blocks, reduction: Reduction, through: FloatArray) -> FloatArray:
    """What (2 b, 2 b) is left in the averages of a drift in each block, once states and parameters have followed it."""
    b, n = len(blocks.t), through.shape[-1]
    states = np.einsum("bac,bcd->bad", blocks.slope[:, :, :NX], reduction.states[blocks.window])
    flat = blocks.slope[:, :, :NX].reshape(2 * b, NX)
    same = np.kron(np.equal.outer(blocks.window, blocks.window), np.ones((2, 2)))
    own = (states.reshape(2 * b, NX) @ flat.T) * same
    shared = through.reshape(2 * b, n) @ reduction.inverse @ through.reshape(2 * b, n).T
    return np.asarray(np.eye(2 * b) - (own + shared) / np.repeat(blocks.weight, 2)[:, None], dtype=float)


def _averaged(problem: Problem, solution: Solution) -> _Blocks | None:
    """Average the errors over blocks; slopes are what the scores change by where its positions are shifted."""
    parts = [(k, part) for k, w in enumerate(problem.windows) for part in _parts(problem, w)]
    if not parts:
        return None
    window = np.array([k for k, _ in parts], dtype=np.int64)
    blocks = replace(problem, windows=tuple(w for _, w in parts), unlogged=None)
    rows = tangents_of(problem, solution.structure, solution.p, solution.first)
    slope = np.stack([_answer(problem, rows[k], k, w.samples) for k, w in parts])
    begins = [problem.windows[k].samples.start for k, _ in parts]
    now = moments(problem, solution.structure, solution.p, solution.first)
    errors = [
        now.residuals[k][w.samples.start - begin : w.samples.stop - begin]
        for (k, w), begin in zip(parts, begins, strict=True)
    ]
    found = [_average(blocks, e, k) for k, e in enumerate(errors)]
    t, weight = np.array([f[0] for f in found]), np.array([f[1] for f in found])
    stretch = np.array([w.stretch for w in blocks.windows], dtype=np.int64)
    return _Blocks(window, stretch, t, np.array([f[2] for f in found]), weight, slope)


def _parts(problem: Problem, window: Window) -> list[Window]:
    """A window's samples in blocks, each with samples of the position."""
    total = sum(w.steps * problem.stretches[w.stretch].h for w in problem.windows)
    stretch = problem.stretches[window.stretch]
    count = max(1, int(window.steps * stretch.h / max(SHORTEST, total / MOST)))
    edges = stretch.start + stretch.h * (window.first + window.steps * np.arange(1, count) / count)
    low, high = window.samples.start, window.samples.stop
    places = [low, *(low + np.searchsorted(stretch.samples.taken[low:high], edges)), high]
    cut = [slice(int(a), int(b)) for a, b in pairwise(places)]
    kind = stretch.samples.kind
    return [replace(window, samples=s) for s in cut if (kind[s] == kernel.POSITION).any()]


def _answer(problem: Problem, rows: FloatArray, number: int, some: slice) -> FloatArray:
    """What the score (2, 8 + np) of a window changes by where some positions stand a metre further north or east."""
    w = problem.windows[number]
    samples = problem.stretches[w.stretch].samples
    inside = np.zeros(len(samples.t), dtype=bool)
    inside[some] = True
    shifted = (inside & (samples.kind == kernel.POSITION))[w.samples]
    weight = shifted / (samples.sigma[w.samples] * problem.inflation[kernel.POSITION])
    out = []
    for axis in range(2):
        shift: FloatArray = np.zeros((len(weight), 2))
        shift[:, axis] = weight
        if problem.whitening is not None:
            shift = problem.whitening.shrunk(number, w.stretch, w.samples, shift)
        out.append(np.einsum("mac,ma->c", rows, shift))
    return np.array(out)


def _average(problem: Problem, error: FloatArray, k: int) -> tuple[float, float, FloatArray]:
    """Time, sum of weights and mean error (2,) of a block, from its samples' weighted errors (m, 2)."""
    w = problem.windows[k]
    samples = problem.stretches[w.stretch].samples
    mine = samples.kind[w.samples] == kernel.POSITION
    root = 1.0 / (samples.sigma[w.samples][mine] * problem.inflation[kernel.POSITION])
    weight = float(np.sum(root**2))
    mean = np.sum(error[mine] * root[:, None], axis=0) / weight
    return float(np.mean(samples.t[w.samples][mine])), weight, mean
