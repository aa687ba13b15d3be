"""What makes errors white that have a known part beside the sensors' noise: along its eigenvectors they shrink.

In units of the sensors' noise the errors' covariance is 1 + G Gᵀ, with what is not logged as columns of G.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from identify.windows import Problem, Window

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Eigenvalues smaller than this change nothing.
LEAST = 1e-2


@dataclass(frozen=True)
class Whitening:
    """What makes the errors of every window white.

    Per stretch ``basis`` (m, 2, K): each window's own eigenvectors, in its samples' rows; ``shrink`` (w, K): λ/(1+λ),
    0 where a window has fewer.
    """

    basis: tuple[FloatArray, ...]
    shrink: FloatArray

    def whitened(self, number: int, stretch: int, samples: slice, error: FloatArray) -> FloatArray:
        """Errors (m, 2) of a window, made white: times the square root of the inverse covariance."""
        return self._less(1.0 - np.sqrt(1.0 - self.shrink[number]), self.basis[stretch][samples], error)

    def whitened_columns(self, number: int, stretch: int, samples: slice, columns: FloatArray) -> FloatArray:
        """Columns (m, 2, k) of a window, made white as ``whitened`` makes its errors."""
        basis, share = self.basis[stretch][samples], 1.0 - np.sqrt(1.0 - self.shrink[number])
        along = np.einsum("maj,mak->jk", basis, columns)
        return np.asarray(columns - np.einsum("maj,jk->mak", basis * share, along), dtype=float)

    def shrunk(self, number: int, stretch: int, samples: slice, error: FloatArray) -> FloatArray:
        """Errors (m, 2) of a window times the inverse covariance."""
        return self._less(self.shrink[number], self.basis[stretch][samples], error)

    def shrunk_columns(self, number: int, stretch: int, samples: slice, columns: FloatArray) -> FloatArray:
        """Columns (m, 2, k) of a window times the inverse covariance."""
        basis = self.basis[stretch][samples]
        along = np.einsum("maj,mak->jk", basis, columns)
        return np.asarray(columns - np.einsum("maj,jk->mak", basis * self.shrink[number], along), dtype=float)

    def gain(self, number: int, stretch: int, samples: slice, error: FloatArray) -> float:
        """What the errors (m, 2) of a window gain in 2 log likelihood by what this leaves open."""
        shrink = self.shrink[number]
        along = np.einsum("mak,ma->k", self.basis[stretch][samples], error)
        return float(np.sum(shrink * along**2 + np.log1p(-shrink)))

    @staticmethod
    def _less(share: FloatArray, basis: FloatArray, error: FloatArray) -> FloatArray:
        """Errors less a share (K,) of what they have along the basis."""
        if not share.any():
            return error
        return np.asarray(error - basis @ (share * np.einsum("mak,ma->k", basis, error)), dtype=float)


def whitening_of(problem: Problem, answers: Sequence[FloatArray]) -> Whitening:
    """What the errors of all windows are whitened by: per stretch the answers (m, 2, K), in its samples' units."""
    shrink = np.zeros((len(problem.windows), max(1, max(a.shape[2] for a in answers))))
    basis = tuple(np.zeros((*a.shape[:2], shrink.shape[1])) for a in answers)
    for number, w in enumerate(problem.windows):
        power, vectors = eigen(weighted(problem, answers, w))
        shrink[number, : len(power)] = power / (1.0 + power)
        basis[w.stretch][w.samples, :, : len(power)] = vectors
    return Whitening(basis, shrink)


def weighted(problem: Problem, answers: Sequence[FloatArray], window: Window) -> FloatArray:
    """Answers (m, 2, K) of a window's samples in units of their weight."""
    sigma = problem.stretches[window.stretch].samples.sigma[window.samples]
    sigma = sigma * problem.inflation[problem.kinds(window)]
    return np.asarray(answers[window.stretch][window.samples] / sigma[:, None, None], dtype=float)


def eigen(answers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (k,) of the answers' covariance, and its eigenvectors (m, 2, k) in the samples' rows."""
    flat = answers.reshape(2 * len(answers), answers.shape[2])
    power, turn = np.linalg.eigh(flat.T @ flat)
    large = power > LEAST
    vectors = flat @ turn[:, large] / np.sqrt(power[large])
    return power[large], vectors.reshape(*answers.shape[:2], -1)
