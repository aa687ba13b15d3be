"""What makes errors white that have a known part beside the sensors' noise: along its eigenvectors they shrink.

In units of the sensors' noise the errors' covariance is 1 + G Gᵀ, with what is not logged as columns of G.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identify.sample import BATCH, Whitens
from identify.threads import abreast
from preprocess.cores import granted

if TYPE_CHECKING:
    from identify.windows import Problem, Window

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: A size, and what samples (m, 2, K) of every stretch show, in their units, of one standard deviation over that size.
Part = tuple[float, Sequence[FloatArray]]

#: Eigenvalues smaller than this change nothing, and what moves them by less than the other need not be looked at.
LEAST, SLIGHT = 1e-2, 1e-3
#: No error shrinks more than this: an answer that is so many times the noise is rounded to all of it.
MOST = float(np.nextafter(1.0, 0.0))


@dataclass(frozen=True)
class Whitening:
    """What makes the errors of every window white.

    Per stretch ``basis`` (m, 2, K): each window's own eigenvectors, in its samples' rows; ``shrink`` (w, K): λ/(1+λ),
    0 after the last that a window has. ``batches`` are the same per stretch as the compiled code goes through them, and
    ``place`` (w,) is where in these a window begins (``in_batches``).
    """

    basis: tuple[FloatArray, ...]
    shrink: FloatArray
    batches: tuple[FloatArray, ...]
    place: IntArray

    def rows(self, stretch: int) -> FloatArray:
        """The basis of a stretch, (2m, K): its samples' rows one after another."""
        basis = self.basis[stretch]
        return basis.reshape(2 * len(basis), basis.shape[2])

    def of(self, stretch: int, windows: IntArray) -> Whitens:
        """What whitens some windows (w,) of a stretch, for the compiled code."""
        return Whitens(self.batches[stretch], self.place[windows], np.ascontiguousarray(self.shrink[windows]))

    def whitened(self, number: int, stretch: int, samples: slice, error: FloatArray) -> FloatArray:
        """Errors (m, 2) of a window, made white: times the square root of the inverse covariance."""
        return self.whitened_columns(number, stretch, samples, error[:, :, None])[:, :, 0]

    def whitened_columns(self, number: int, stretch: int, samples: slice, columns: FloatArray) -> FloatArray:
        """Columns (m, 2, k) of a window, made white as ``whitened`` makes its errors."""
        return self._less(1.0 - np.sqrt(1.0 - self.shrink[number]), stretch, samples, columns)

    def shrunk(self, number: int, stretch: int, samples: slice, error: FloatArray) -> FloatArray:
        """Errors (m, 2) of a window times the inverse covariance."""
        return self.shrunk_columns(number, stretch, samples, error[:, :, None])[:, :, 0]

    def shrunk_columns(self, number: int, stretch: int, samples: slice, columns: FloatArray) -> FloatArray:
        """Columns (m, 2, k) of a window times the inverse covariance."""
        return self._less(self.shrink[number], stretch, samples, columns)

    def gain(self, number: int, stretch: int, samples: slice, error: FloatArray) -> float:
        """What the errors (m, 2) of a window gain in 2 log likelihood by what this leaves open."""
        shrink = self.shrink[number]
        along = self._along(stretch, samples).T @ error.ravel()
        return float(np.sum(shrink * along**2 + np.log1p(-shrink)))

    def _along(self, stretch: int, samples: slice) -> FloatArray:
        """The basis (2m, K) in the rows of some samples."""
        return self.rows(stretch)[2 * samples.start : 2 * samples.stop]

    def _less(self, share: FloatArray, stretch: int, samples: slice, columns: FloatArray) -> FloatArray:
        """Columns (m, 2, k) less a share (K,) of what they have along the basis."""
        used = int(np.count_nonzero(share))
        if not used:
            return columns
        basis = self._along(stretch, samples)[:, :used]
        flat = columns.reshape(len(basis), -1)
        less = basis @ (share[:used, None] * (basis.T @ flat))
        return np.asarray((flat - less).reshape(columns.shape), dtype=float)


def whitening_of(problem: Problem, parts: Sequence[Part]) -> Whitening:
    """What the errors of all windows are whitened by."""
    found = abreast(lambda w: eigen(within(problem, parts, w)), problem.windows, granted())
    shrink = np.zeros((len(found), max(1, max(len(power) for power, _ in found))))
    basis = tuple(np.zeros((len(s.samples.t), 2, shrink.shape[1])) for s in problem.stretches)
    for number, (w, (power, vectors)) in enumerate(zip(problem.windows, found, strict=True)):
        shrink[number, : len(power)] = np.minimum(power / (1.0 + power), MOST)
        basis[w.stretch][w.samples, :, : len(power)] = vectors
    return Whitening(basis, shrink, *_every_batch(problem, [vectors for _, vectors in found]))


def _every_batch(problem: Problem, vectors: Sequence[FloatArray]) -> tuple[tuple[FloatArray, ...], IntArray]:
    """Every stretch's windows one after the other as ``in_batches``, and where (w,) in its stretch each begins."""
    parts: list[list[FloatArray]] = [[] for _ in problem.stretches]
    place, filled = np.zeros(len(vectors), dtype=np.int64), [0] * len(parts)
    for number, (w, mine) in enumerate(zip(problem.windows, vectors, strict=True)):
        found = in_batches(mine, problem.two_axes(w))
        parts[w.stretch].append(found)
        place[number], filled[w.stretch] = filled[w.stretch], filled[w.stretch] + len(found)
    return tuple(np.concatenate([np.zeros(0), *some]) for some in parts), place


def in_batches(vectors: FloatArray, two: BoolArray) -> FloatArray:
    """Eigenvectors (m, 2, k) in the order in which rows are summed: batch by batch, of each vector what it has there.

    A sample has two rows where it has ``two`` (m,) axes, else one; what is missing of the last batch is nothing.
    """
    measured = np.stack([np.ones_like(two), two], axis=1)
    rows = vectors[measured]
    rows = np.concatenate([rows, np.zeros((-len(rows) % BATCH, rows.shape[1]))])
    return rows.reshape(len(rows) // BATCH, BATCH, rows.shape[1]).transpose(0, 2, 1).ravel()


def within(problem: Problem, parts: Sequence[Part], window: Window) -> FloatArray:
    """All parts (m, 2, K) in a window's samples, each column of one standard deviation, as ``weighted`` gives them."""
    nothing = np.zeros((len(problem.kinds(window)), 2, 0))
    return np.concatenate([nothing, *(size * weighted(problem, a, window) for size, a in parts)], axis=2)


def weighted(problem: Problem, answers: Sequence[FloatArray], window: Window) -> FloatArray:
    """Answers (m, 2, K) of a window's samples in units of their weight, less what of a drift and of waves is known."""
    sigma = problem.stretches[window.stretch].samples.sigma[window.samples]
    sigma = sigma * problem.inflation[problem.kinds(window)]
    return problem.less_known(window, answers[window.stretch][window.samples] / sigma[:, None, None])


def eigen(answers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (k,) of the answers' covariance, and its eigenvectors (m, 2, k) in the samples' rows."""
    flat = _shown(answers.reshape(2 * len(answers), answers.shape[2]))
    power, turn = np.linalg.eigh(flat.T @ flat)
    large = power > LEAST
    vectors = flat @ turn[:, large] / np.sqrt(power[large])
    return power[large], vectors.reshape(*answers.shape[:2], -1)


def _shown(columns: FloatArray) -> FloatArray:
    """Columns (2m, K) without the smallest, which all together move no eigenvalue by what counts."""
    size = np.einsum("mk,mk->k", columns, columns)
    order = np.argsort(size)
    return columns[:, np.sort(order[np.cumsum(size[order]) > SLIGHT])]
