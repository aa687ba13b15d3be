"""How likely a wander of the heading is beside its white noise and a gyro whose own noise adds up.

Restricted likelihood (Patterson and Thompson 1971) over pieces, with what all have alike and what each has of its own
taken off as far as it goes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

from preprocess.against_gyro import EXACT, UNTOLD, Piece
from preprocess.trial import FloatArray

#: Sizes are sought between these, as logarithms, in units of the white noise of a block.
RANGE = (-5.0, 8.0)
#: So much, as a logarithm, may the gyro's noise add up faster than its samples say: they miss what is between them.
WALKS = (0.0, 1.2)
#: Evaluations of the likelihood in a search.
MOST_EVALUATIONS = 90


class Likeliest(NamedTuple):
    """Least -2 log likelihood, the size of the wander there, rad, and the heading's white noise, rad."""

    deviance: float
    size: float
    white: float


def likeliest(pieces: Sequence[Piece], time: float | None) -> Likeliest:
    """The likeliest of the gyro's noises and of a wander of the heading with a ``time`` constant, s; None: without.

    Sizes are counted in the white noise of a block: what the gyro's rate does in a piece, and the heading at any time;
    what the gyro's own noise adds up to, in what it is taken for.
    """
    unit = [_unit(p, time) for p in pieces]
    block = 1.0 / float(np.median(np.concatenate([p.samples for p in pieces])))
    lasts = float(np.median([p.t[-1] - p.t[0] for p in pieces]))
    few = 2 + (time is not None)
    scales = np.array([1.0, 3.0 * block / lasts**3, block])[:few]

    def objective(x: FloatArray) -> float:
        return _deviance(pieces, unit, scales * np.exp(2.0 * x))[0]

    begin, step = np.array([0.2, -1.0, 1.0])[:few], np.array([0.5, 1.5, 1.0])[:few]
    options = {"initial_simplex": np.vstack([begin, begin + np.diag(step)]),
               "xatol": 0.05, "fatol": 0.05, "maxfev": MOST_EVALUATIONS}  # fmt: skip
    bounds = [WALKS, RANGE, RANGE][:few]
    best = minimize(objective, begin, method="Nelder-Mead", bounds=bounds, options=options)  # type: ignore[call-overload]
    _, noise = _deviance(pieces, unit, scales * np.exp(2.0 * best.x))
    size = float(np.sqrt(noise * block) * np.exp(best.x[-1])) if time is not None else 0.0
    return Likeliest(float(best.fun), size, float(np.sqrt(noise)))


def _unit(piece: Piece, time: float | None) -> FloatArray:
    """Covariances (k, b, b): white noise of unit size, the gyro's that adds up, its rate's walk, and a wander."""
    at = piece.t - piece.t[0]
    first, last = np.minimum.outer(at, at), np.maximum.outer(at, at)
    parts = [np.diag(1.0 / piece.samples), piece.walk * first, first**2 * (3.0 * last - first) / 6.0]
    if time is not None:
        parts.append(np.exp(-(last - first) / time))
    return np.array(parts)


def _deviance(pieces: Sequence[Piece], unit: Sequence[FloatArray], sizes: FloatArray) -> tuple[float, float]:
    """-2 log restricted likelihood with variances of these ``sizes`` over white noise's, at its likeliest; and that.

    Each piece has an angle of its own.
    """
    logs, gram = 0.0, np.zeros(2 * (pieces[0].columns.shape[1] + 1,))
    for p, parts in zip(pieces, unit, strict=True):
        lower = np.linalg.cholesky(parts[0] + np.einsum("k,kij->ij", sizes, parts[1:]))
        columns = np.column_stack([np.ones(len(p.t)), p.columns, p.value])
        right = solve_triangular(lower, columns, lower=True, check_finite=False)
        products = right.T @ right
        logs += 2.0 * np.log(np.diag(lower)).sum() + np.log(products[0, 0])
        gram = gram + products[1:, 1:] - np.outer(products[1:, 0], products[0, 1:]) / products[0, 0]
    information, score = gram[:-1, :-1], gram[:-1, -1]
    root = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    information, score = information * root * root[:, None], score * root
    values, vectors = np.linalg.eigh(information)
    shown = values > UNTOLD * values[-1]
    reached = (vectors[:, shown].T @ score) ** 2 / values[shown]
    free = sum(len(p.t) - 1 for p in pieces) - int(shown.sum())
    noise = max(float(gram[-1, -1] - reached.sum()) / free, EXACT**2)
    return float(logs + np.log(values[shown]).sum() - 2.0 * np.log(root).sum() + free * np.log(noise)), noise
