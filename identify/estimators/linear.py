"""Least squares and ridge regression."""

from __future__ import annotations

from typing import Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike

from .estimate import Common, Estimate, FloatArray, Settings
from .judge import Outcome, estimate, residuals
from .problem import Compressed, Problem, compress, problem
from .solve import dependences, least_squares, penalised

DIRECT = "Solved directly."


def fit_ls(
    design: ArrayLike,
    target: ArrayLike,
    *,
    groups: ArrayLike | None = None,
    bias: bool = False,
    weights: ArrayLike | None = None,
    **common: Unpack[Common],
) -> Estimate:
    """Ordinary (or weighted) least squares by QR of scaled columns; collinear columns are merged.

    Parameters
    ----------
    design, target : (l, d), (l,)
    groups : (l,) int, optional
        Unbroken stretch of each row, for the covariance.
    bias : bool
        Whether to add an intercept.
    weights : (l,), optional
        Known weights of the squared residuals.
    **common
        See `Settings`.
    """
    settings = Settings(**common)
    data = problem(design, target, groups, bias=bias)
    known = None if weights is None else np.asarray(weights, dtype=float)
    small = compress(data, known, exact=True)
    kept, dropped = dependences(small.factor, settings.tolerance)
    solution = least_squares(small, kept)
    outcome = Outcome(solution, residuals(data, solution.beta), dropped, DIRECT, weights=known)
    return estimate(data, outcome, settings)


def fit_ridge(
    design: ArrayLike,
    target: ArrayLike,
    *,
    groups: ArrayLike | None = None,
    penalty: float | Literal["gcv"] = "gcv",
    bias: bool = False,
    **common: Unpack[Common],
) -> Estimate:
    """Ridge regression on columns of unit root mean square; the bias is free.

    Parameters
    ----------
    penalty : float or "gcv"
        λ per sample, of Σ e² / l + λ |β|²; "gcv" minimises the generalised cross-validation score
        (Golub, Heath and Wahba 1979).
    """
    settings = Settings(**common)
    data = problem(design, target, groups, bias=bias)
    small = compress(data, exact=True)
    value = generalised_cross_validation(data, small) if penalty == "gcv" else float(penalty)
    solution = penalised(small, _ridge_penalty(data, value))
    kept, dropped = dependences(small.factor, settings.tolerance)
    if value == 0.0:
        solution = least_squares(small, kept)
    outcome = Outcome(
        solution,
        residuals(data, solution.beta),
        dropped,
        DIRECT,
        merged=value == 0.0,
        hyper={"penalty": value},
    )
    return estimate(data, outcome, settings)


def _ridge_penalty(data: Problem, value: float) -> FloatArray:
    penalty = np.full(data.columns, value * len(data.target))
    if data.bias:
        penalty[-1] = 0.0
    return penalty


def generalised_cross_validation(data: Problem, small: Compressed, grid: int = 121) -> float:
    """Find the λ per sample that minimises l·RSS / (l - tr H)², on a logarithmic grid."""
    left, singular, z = _without_bias(data, small)
    projected = left.T @ z
    rows = len(data.target)
    candidates = np.logspace(-14, 2, grid) * rows
    shrink = singular**2 / (singular**2 + candidates[:, None])
    rest = small.rest + float(z @ z - projected @ projected)
    squares = ((1 - shrink) ** 2) @ projected**2 + max(rest, 0.0)
    freedom = rows - shrink.sum(axis=1) - int(data.bias)
    return float(candidates[np.argmin(squares / freedom**2)] / rows)


def _without_bias(data: Problem, small: Compressed) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Singular values of the factor with the free intercept projected out, and what is left of z."""
    factor, z = small.factor, small.reduced
    if data.bias:
        direction = factor[:, -1] / np.linalg.norm(factor[:, -1])
        factor = factor[:, :-1] - np.outer(direction, direction @ factor[:, :-1])
        z = z - direction * (direction @ z)
    left, singular, _ = np.linalg.svd(factor, full_matrices=False)
    return left, singular, z
