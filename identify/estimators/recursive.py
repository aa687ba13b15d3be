"""Least squares that is updated as samples come in, with exponential forgetting."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from .estimate import Common, Estimate, FloatArray, Settings
from .judge import Outcome, estimate, package, residuals
from .problem import Compressed, problem
from .solve import dependences, least_squares


@dataclass(frozen=True)
class RecursiveState:
    """All that recursive least squares remembers: it can be saved at any time and taken up again.

    Attributes
    ----------
    factor : (p + 1, p + 1)
        Triangular factor of the forgotten-weighted moments of [design, 1 if ``bias``, target]: the square
        root of the information, which cannot lose its symmetry or sign as the covariance form does.
    forgetting : float
        Weight of a sample relative to the next one, 0 < λ <= 1.
    count : int
        Samples seen.
    memory : float
        Sum of the weights: the samples still remembered.
    energy, neighbours, last : float
        Forgotten sums of squared errors of prediction and of products of neighbours, and the last error.
    """

    factor: FloatArray
    forgetting: float
    bias: bool
    count: int = 0
    memory: float = 0.0
    energy: float = 0.0
    neighbours: float = 0.0
    last: float = 0.0

    @property
    def theta(self) -> FloatArray:
        """Current coefficients, the bias last where there is one, (p,)."""
        return _solve(self.factor, 1e-12)


def start(columns: int, *, forgetting: float = 1.0, bias: bool = False) -> RecursiveState:
    """State before the first sample."""
    if not 0.0 < forgetting <= 1.0:
        raise ValueError(f"expected a forgetting factor in (0, 1], found {forgetting}")
    size = columns + int(bias) + 1
    return RecursiveState(np.zeros((size, size)), forgetting, bias)


def update(state: RecursiveState, design: ArrayLike, target: ArrayLike) -> RecursiveState:
    """Take in the next samples: one (d,) with its target, or a block (m, d) with (m,).

    However a record is cut into blocks, the coefficients are the same.
    """
    rows, values = (
        np.atleast_2d(np.asarray(design, dtype=float)),
        np.atleast_1d(np.asarray(target, dtype=float)),
    )
    if len(values) == 0:
        return state
    table = np.column_stack([rows, np.ones(len(rows)), values] if state.bias else [rows, values])
    if table.shape[1] != len(state.factor) or not np.isfinite(table).all():
        raise ValueError(f"expected finite rows of {len(state.factor) - 1 - state.bias} columns and targets")
    age = np.sqrt(state.forgetting) ** np.arange(len(table) - 1, -1, -1)
    stacked = np.vstack([state.factor * np.sqrt(state.forgetting) ** len(table), table * age[:, None]])
    factor: FloatArray = np.asarray(np.linalg.qr(stacked, mode="r"))
    judge = state.theta if state.count >= 2 * len(factor) else _solve(factor, 1e-12)
    return replace(_remember(state, table[:, -1] - table[:, :-1] @ judge), factor=factor)


def _remember(state: RecursiveState, errors: FloatArray) -> RecursiveState:
    n, rate = len(errors), state.forgetting
    age = rate ** np.arange(n - 1, -1, -1)
    previous = np.concatenate([[state.last], errors[:-1]])
    return replace(
        state,
        count=state.count + n,
        memory=state.memory * rate**n + float(age.sum()),
        energy=state.energy * rate**n + float(age @ errors**2),
        neighbours=state.neighbours * rate**n + float(age @ (errors * previous)),
        last=float(errors[-1]),
    )


def _solve(factor: FloatArray, tolerance: float) -> FloatArray:
    columns = factor[:, :-1]
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    solved = np.linalg.lstsq(columns / scale, factor[:, -1], rcond=tolerance)[0]
    return np.asarray(solved / scale)


def current(state: RecursiveState, **common: Unpack[Common]) -> Estimate:
    """Give the estimate at this moment, from the state alone.

    The correlation of the residuals is known here by its first lag only: the covariance is that of
    independent residuals times (1 + ρ) / (1 - ρ).
    """
    settings = Settings(**common)
    p = len(state.factor) - 1
    if state.count <= p:
        raise ValueError(f"expected more than {p} samples, found {state.count}")
    scale = np.linalg.norm(state.factor[:, :p], axis=0) / np.sqrt(max(state.memory, 1.0))
    scale[scale == 0] = 1.0
    outcome, rest = _solve_scaled(state, scale, settings)
    sigma = float(np.sqrt(rest / max(state.memory - outcome.solution.degrees, 1.0)))
    rho = float(np.clip(state.neighbours / state.energy, 0.0, 0.99)) if state.energy > 0 else 0.0
    covariance = outcome.solution.bread * sigma**2 * (1 + rho) / (1 - rho)
    return package(outcome, settings, scale, covariance, sigma, has_bias=state.bias)


def _solve_scaled(state: RecursiveState, scale: FloatArray, settings: Settings) -> tuple[Outcome, float]:
    p = len(scale)
    small = Compressed(state.factor[:p, :p] / scale, state.factor[:p, p], float(state.factor[p, p] ** 2))
    kept, dropped = dependences(small.factor, settings.tolerance)
    text = f"Updated with {state.count} samples."
    hyper = {"forgetting": state.forgetting}
    return Outcome(least_squares(small, kept), np.zeros(0), dropped, text, hyper=hyper), small.rest


def fit_recursive_ls(
    design: ArrayLike,
    target: ArrayLike,
    *,
    groups: ArrayLike | None = None,
    forgetting: float = 1.0,
    bias: bool = False,
    **common: Unpack[Common],
) -> Estimate:
    """Recursive least squares over a whole record: what the stream would hold at its end.

    Parameters
    ----------
    forgetting : float
        Weight of a sample relative to the next one; 1 is ordinary least squares, λ remembers 1 / (1 - λ)
        samples.
    """
    settings = Settings(**common)
    data = problem(design, target, groups, bias=bias)
    state = update(
        start(data.design.shape[1], forgetting=forgetting, bias=data.bias), data.design, data.target
    )
    outcome, _ = _solve_scaled(state, data.all_scales, settings)
    weights = None
    if forgetting < 1.0:
        weights = forgetting ** np.arange(len(data.target) - 1.0, -1.0, -1.0)
    residual = residuals(data, outcome.solution.beta)
    return estimate(data, replace(outcome, residual=residual, weights=weights), settings)
