"""How likely errors that wander are, of a sensor or of one of its rate, beside white noise that adds up in the latter.

Restricted likelihood (Patterson and Thompson 1971) over pieces, with what all have alike and what each has of its own
taken off as far as it goes. A wander is first-order Gauss-Markov noise; of the rate it counts as its integral.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

from preprocess.integrated import EXACT, UNTOLD, Piece
from preprocess.trial import FloatArray

#: Sizes are sought between these, as logarithms, in units of the white noise of a block.
RANGE = (-5.0, 8.0)
#: So much, as a logarithm, may the rate's noise add up faster than its samples say at the most: they miss what is
#: between them.
MISSED = 1.2
#: Where searches begin, as logarithms, and how far first steps go: of the walk, in parts of what may be missed, of a
#: wander, and of a rate that walks.
BEGIN, STEP = (0.2, 1.0, -1.0), (0.4, 1.0, 1.5)
#: Evaluations of the likelihood in a search.
MOST_EVALUATIONS = 90


class Errors(NamedTuple):
    """What errors are taken for: a wander of the value and one of its rate, by their time constants, s.

    The value's is ``smooth`` where a filter has passed it on: critically damped of second order, not of first.
    ``walks`` where the rate's constant error may change by and by; ``missed``, as a logarithm, how much faster its
    noise may add up than its samples say.
    """

    own: float | None = None
    rate: float | None = None
    smooth: bool = False
    walks: bool = True
    missed: float = MISSED


class Likeliest(NamedTuple):
    """Least -2 log likelihood; sizes of the wanders there (0 where there is none), and the value's white noise."""

    deviance: float
    own: float
    rate: float
    white: float


class _Part(NamedTuple):
    """Part of a covariance: its unit in every piece (b, b), the scale of its size, and where that is sought."""

    units: list[FloatArray]
    scale: float
    begin: float
    step: float
    bounds: tuple[float, float]


def likeliest(pieces: Sequence[Piece], errors: Errors) -> Likeliest:
    """The likeliest sizes of what the ``errors`` of some pieces are taken for.

    Sizes are counted in the white noise of a block: what the rate's errors do in a piece, and the value's at any time;
    what the rate's white noise adds up to, in what it is taken for.
    """
    units, variances = _searched(pieces, errors)
    deviance, noise = _deviance(pieces, units, variances)
    sizes = iter(np.sqrt(noise * variances))
    next(sizes)
    own = float(next(sizes)) if errors.own is not None else 0.0
    rate = float(next(sizes)) if errors.rate is not None else 0.0
    return Likeliest(deviance, own, rate, float(np.sqrt(noise)))


def columns_of(pieces: Sequence[Piece], errors: Errors) -> tuple[FloatArray, FloatArray]:
    """How much (k,) of the columns is in the values, and its covariance (k, k), with errors of the likeliest sizes.

    Generalised least squares. What no piece tells is nothing, and its variance infinite.
    """
    units, variances = _searched(pieces, errors)
    _, gram = _products(pieces, units, variances)
    _, noise = _deviance(pieces, units, variances)
    information, score, root = _scaled(gram)
    values, vectors = np.linalg.eigh(information)
    shown = values > UNTOLD * values[-1]
    told = vectors[:, shown] / values[shown] @ vectors[:, shown].T
    untold = np.diag(np.where(np.sum(vectors[:, ~shown] ** 2, axis=1) > 0.5, np.inf, 0.0))
    return root * (told @ score), noise * told * root * root[:, None] + untold


def _searched(pieces: Sequence[Piece], errors: Errors) -> tuple[list[FloatArray], FloatArray]:
    """Covariances of unit size of each piece, and the likeliest variances in white noise's."""
    parts = _parts(pieces, errors)
    white = [np.diag(1.0 / p.samples) for p in pieces]
    units = [np.array([w, *(part.units[k] for part in parts)]) for k, w in enumerate(white)]
    scales = np.array([part.scale for part in parts])

    def objective(x: FloatArray) -> float:
        return _deviance(pieces, units, scales * np.exp(2.0 * x))[0]

    begin, step = (np.array([getattr(part, k) for part in parts]) for k in ("begin", "step"))
    options = {"initial_simplex": np.vstack([begin, begin + np.diag(step)]),
               "xatol": 0.05, "fatol": 0.05, "maxfev": MOST_EVALUATIONS}  # fmt: skip
    bounds = [part.bounds for part in parts]
    best = minimize(objective, begin, method="Nelder-Mead", bounds=bounds, options=options)  # type: ignore[call-overload]
    return units, scales * np.exp(2.0 * best.x)


def _parts(pieces: Sequence[Piece], errors: Errors) -> list[_Part]:
    """What the errors are taken for beside white noise: the rate's that adds up, wanders, and a rate that walks."""
    at = [p.t - p.t[0] for p in pieces]
    both = [(np.minimum.outer(t, t), np.maximum.outer(t, t)) for t in at]
    block = 1.0 / float(np.median(np.concatenate([p.samples for p in pieces])))
    lasts = float(np.median([t[-1] for t in at]))
    missed, wander, rate_walk = zip(BEGIN, STEP, strict=True)
    walk = (errors.missed * missed[0], errors.missed * missed[1], (0.0, errors.missed))
    begun = [p.length + first for p, (first, _) in zip(pieces, both, strict=True)]  # a block before the first
    added = [p.walk * _averaged(b, -p.length / 6.0) for p, b in zip(pieces, begun, strict=True)]
    found = [_Part(added, 1.0, *walk)]
    if errors.own is not None:
        apart = [(last - first) / errors.own for first, last in both]
        lengths = [p.length / errors.own for p in pieces]
        units = [_smooth(a) if errors.smooth else _rough(a, x) for a, x in zip(apart, lengths, strict=True)]
        found.append(_Part(units, block, *wander, RANGE))
    if errors.rate is not None:
        units = [_added_up(first, last, errors.rate) for first, last in both]
        once = np.array([[lasts]])
        found.append(_Part(units, block / float(_added_up(once, once, errors.rate)[0, 0]), *wander, RANGE))
    if errors.walks:
        units = [first**2 * (3.0 * last - first) / 6.0 for first, last in both]
        found.append(_Part(units, 3.0 * block / lasts**3, *rate_walk, RANGE))
    return found


def _averaged(covariance: FloatArray, more: float) -> FloatArray:
    """Covariance (b, b) of averages over blocks: only their own variances differ by more than a trifle."""
    return np.asarray(covariance + more * np.eye(len(covariance)), dtype=float)


def _rough(apart: FloatArray, length: float) -> FloatArray:
    """Covariance (b, b) of a wander of unit size, averaged over blocks of a ``length``, all in time constants."""
    return _averaged(np.exp(-apart), _of_average(length) - 1.0)


def _smooth(apart: FloatArray) -> FloatArray:
    """The same of a smooth one, of which an average over a block is as good as its middle."""
    return np.asarray((1.0 + apart) * np.exp(-apart), dtype=float)


def _of_average(x: float) -> float:
    """Variance of a wander of unit size, averaged over ``x`` of its time constants."""
    return float(2.0 * (x - 1.0 + np.exp(-x)) / x**2)


def _added_up(first: FloatArray, last: FloatArray, time: float) -> FloatArray:
    """Covariance (b, b) of what a wander of unit size adds up to since the begin, at the earlier and the later time."""
    f, g = first / time, last / time
    return np.asarray(time**2 * (2.0 * f - 1.0 + np.exp(-f) + np.exp(-g) - np.exp(f - g)), dtype=float)


def _deviance(pieces: Sequence[Piece], unit: Sequence[FloatArray], sizes: FloatArray) -> tuple[float, float]:
    """-2 log restricted likelihood with variances of these ``sizes`` over white noise's, at its likeliest; and that.

    Each piece has a constant of its own.
    """
    logs, gram = _products(pieces, unit, sizes)
    information, score, root = _scaled(gram)
    values, vectors = np.linalg.eigh(information)
    shown = values > UNTOLD * values[-1]
    reached = (vectors[:, shown].T @ score) ** 2 / values[shown]
    free = sum(len(p.t) - 1 for p in pieces) - int(shown.sum())
    noise = max(float(gram[-1, -1] - reached.sum()) / free, EXACT**2)
    return float(logs + np.log(values[shown]).sum() - 2.0 * np.log(root).sum() + free * np.log(noise)), noise


def _products(
    pieces: Sequence[Piece], unit: Sequence[FloatArray], sizes: FloatArray
) -> tuple[float, FloatArray]:
    """Log determinant of what the pieces' errors are, and the products (k + 1, k + 1) of columns and values by it."""
    logs, gram = 0.0, np.zeros(2 * (pieces[0].columns.shape[1] + 1,))
    for p, parts in zip(pieces, unit, strict=True):
        lower = np.linalg.cholesky(parts[0] + np.einsum("k,kij->ij", sizes, parts[1:]))
        columns = np.column_stack([np.ones(len(p.t)), p.columns, p.value])
        right = solve_triangular(lower, columns, lower=True, check_finite=False)
        products = right.T @ right
        logs += 2.0 * np.log(np.diag(lower)).sum() + np.log(products[0, 0])
        gram = gram + products[1:, 1:] - np.outer(products[1:, 0], products[0, 1:]) / products[0, 0]
    return logs, gram


def _scaled(gram: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Information (k, k) of the columns and their score (k,), each column scaled to an information of one by (k,)."""
    information, score = gram[:-1, :-1], gram[:-1, -1]
    root = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    return information * root * root[:, None], score * root, root
