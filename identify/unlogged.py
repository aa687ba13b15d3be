"""What the inputs hide between their samples, and what that leaves open in every window's predictions.

The predictions' errors in a window are no white noise of the sensors alone: the vessel answered to what the inputs
did between their samples (``identify.bridges``), which no log says. In units of the sensors' noise the errors'
covariance is 1 + G Gᵀ, with the answers as columns of G. Errors and tangents are made white with it: along its
eigenvectors they become smaller by 1/√(1+λ). How much of the largest possible variance there really is (a log may be
written at every change) is the share that the errors themselves are most likely with.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from identify import kernel
from identify.bridges import Shapes, shapes_of
from identify.compiled import rows_of, sensing_of
from identify.drive import drive
from identify.regression import through_water
from identify.structure import Structure
from identify.tangents import Along, padded

if TYPE_CHECKING:
    from identify.windows import Problem, Window

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Eigenvalues smaller than this change nothing.
LEAST = 1e-2
#: Shares of the largest possible variance that are tried.
SHARES = (0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
#: Gain in 2 log likelihood from which a share is believed.
BELIEVED = 6.0


@dataclass(frozen=True)
class Unlogged:
    """What answers to the inputs: a structure and its parameters ``p`` (np,); and the share of the largest variance.

    ``answers``: per stretch (m, 2, K), what its samples would show of each shape in the ``windows``, in their units.
    """

    structure: Structure
    p: FloatArray
    share: float
    windows: tuple[Window, ...]
    answers: tuple[FloatArray, ...]

    @property
    def sized(self) -> tuple[FloatArray, ...]:
        """The answers, each of one standard deviation."""
        return tuple(math.sqrt(self.share) * a for a in self.answers)

    def over(self, problem: Problem) -> Unlogged:
        """The same for a problem's stretches and windows."""
        if problem.windows is self.windows:
            return self
        return unlogged(problem, self.structure, self.p, self.share)


def unlogged(problem: Problem, structure: Structure, p: FloatArray, share: float = 1.0) -> Unlogged:
    """What the inputs may have done between their samples in a problem's windows."""
    answers = [_of_stretch(problem, structure, p, k) for k in range(len(problem.stretches))]
    return Unlogged(structure, p, share, problem.windows, tuple(answers))


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
        power, vectors = _eigen(_weighted(problem, answers, w), 1.0)
        shrink[number, : len(power)] = power / (1.0 + power)
        basis[w.stretch][w.samples, :, : len(power)] = vectors
    return Whitening(basis, shrink)


def _weighted(problem: Problem, answers: Sequence[FloatArray], window: Window) -> FloatArray:
    """Answers (m, 2, K) of a window's samples in units of their weight."""
    sigma = problem.stretches[window.stretch].samples.sigma[window.samples]
    sigma = sigma * problem.inflation[problem.kinds(window)]
    return np.asarray(answers[window.stretch][window.samples] / sigma[:, None, None], dtype=float)


def most_likely(
    problem: Problem, structure: Structure, p: FloatArray, raw: Sequence[FloatArray]
) -> Unlogged | None:
    """What errors ``raw`` (m, 2) of each window are likeliest with; None where the inputs hide nothing.

    Positions are left out: their slow errors may as well be the receiver's.
    """
    most = unlogged(problem, structure, p)
    gains = _gains(problem, most, raw)
    best = int(np.argmax(gains))
    return replace(most, share=SHARES[best]) if gains[best] > BELIEVED else None


def _gains(problem: Problem, known: Unlogged, raw: Sequence[FloatArray]) -> FloatArray:
    """What each share gains in 2 log likelihood (shares,)."""
    gains, share = np.zeros(len(SHARES)), np.array(SHARES)[:, None]
    for w, error in zip(problem.windows, raw, strict=True):
        steady = (problem.kinds(w) != kernel.POSITION)[:, None]
        power, vectors = _eigen(_weighted(problem, known.answers, w) * steady[:, :, None], 1.0)
        along = np.einsum("mak,ma->k", vectors, error * steady)
        gains += np.sum(along**2 * share * power / (1.0 + share * power) - np.log1p(share * power), axis=1)
    return gains


def _eigen(answers: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (k,) of the answers' covariance, and its eigenvectors (m, 2, k) in the samples' rows."""
    flat = answers.reshape(2 * len(answers), answers.shape[2])
    power, turn = np.linalg.eigh(share * (flat.T @ flat))
    large = power > LEAST
    vectors = math.sqrt(share) * flat @ turn[:, large] / np.sqrt(power[large])
    return power[large], vectors.reshape(*answers.shape[:2], -1)


def _of_stretch(problem: Problem, structure: Structure, p: FloatArray, number: int) -> FloatArray:
    """What a stretch's samples would show (m, 2, K) of each shape, in their own units."""
    stretch = problem.stretches[number]
    windows = [w for w in problem.windows if w.stretch == number]
    nothing = np.zeros((len(stretch.samples.t), 2, 0))
    if not windows:
        return nothing
    here = drive(structure, p, stretch)
    shapes = shapes_of(structure, p, stretch, [(w.first, w.steps) for w in windows])
    if not shapes.count:
        return nothing
    width = padded(kernel.NX + shapes.count)
    first = np.zeros((len(windows), kernel.NX))
    first[:, :6] = through_water(stretch.states[[w.first for w in windows]], here.current)
    sensing = sensing_of(np.ones(4), stretch, here.sensor, np.zeros((kernel.NM, width)))
    columns = slice(kernel.NX, kernel.NX + shapes.count)
    rows = rows_of(structure, here, stretch, windows, first, _along(shapes, width), sensing, columns)
    return rows * stretch.samples.sigma[:, None, None]


def _along(shapes: Shapes, width: int) -> Along:
    """Directions that are the shapes alone, each in all channels."""
    steps, count, channels = shapes.mean.shape
    none, nothing = np.zeros(0, dtype=np.int64), np.zeros(0)
    place = np.tile(kernel.CHANNEL + np.arange(channels), count)
    column = kernel.NX + np.arange(count)
    mean, slope = shapes.mean.reshape(steps, -1), shapes.slope.reshape(steps, -1)
    return Along(
        none, none, none, nothing, none, none, none, nothing, column, place, np.repeat(column, channels),
        mean, slope, np.zeros((2, width)),
    )  # fmt: skip
