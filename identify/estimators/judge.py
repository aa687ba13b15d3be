"""From a solution to an estimate: units, covariance, and what the data could not give."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from .covariance import meat
from .estimate import BoolArray, Estimate, FloatArray, Settings
from .problem import Problem, column_names, with_ones
from .solve import Dependence, Solution


@dataclass(frozen=True)
class Outcome:
    """What an estimator hands over to be judged.

    Attributes
    ----------
    solution : Solution
        In scaled columns.
    residual : (l,)
        Target less prediction.
    weights : (l,), optional
        Of the samples.
    scores : (l, p), optional
        Influence of each sample on the estimating equations, columns unscaled, where it is not x·w·e.
    merged : bool
        Whether the dependent columns were left out (True), or the penalty shared the coefficient out (False).
    """

    solution: Solution
    residual: FloatArray
    dependences: tuple[Dependence, ...]
    stopped: str
    weights: FloatArray | None = None
    scores: FloatArray | None = None
    merged: bool = True
    sigma: float | None = None
    hyper: Mapping[str, float] = field(default_factory=dict)


def estimate(data: Problem, outcome: Outcome, settings: Settings) -> Estimate:
    """Turn an outcome into an estimate in the units of the data."""
    sigma = _spread(outcome) if outcome.sigma is None else outcome.sigma
    covariance = _covariance(data, outcome, settings, sigma)
    return package(outcome, settings, data.all_scales, covariance, sigma, has_bias=data.bias)


def package(
    outcome: Outcome,
    settings: Settings,
    scale: FloatArray,
    covariance: FloatArray,
    sigma: float,
    *,
    has_bias: bool,
) -> Estimate:
    """Write scaled coefficients and their covariance (p, p) as an estimate; the bias, if any, is the last."""
    beta, covariance = outcome.solution.beta / scale, covariance / np.outer(scale, scale)
    d = len(beta) - int(has_bias)
    identifiable, reasons = _verdicts(beta[:d], covariance[:d, :d], outcome, settings)
    return Estimate(
        theta=beta[:d],
        covariance=covariance[:d, :d],
        bias=float(beta[d]) if has_bias else 0.0,
        sigma=sigma,
        weights=outcome.weights,
        identifiable=identifiable,
        reasons=reasons,
        stopped=outcome.stopped,
        bias_stderr=float(np.sqrt(max(covariance[d, d], 0.0))) if has_bias else 0.0,
        hyper=outcome.hyper,
    )


def residuals(data: Problem, beta: FloatArray) -> FloatArray:
    """Target less the prediction of scaled coefficients, (l,)."""
    beta = beta / data.all_scales
    d = data.design.shape[1]
    left: FloatArray = data.target - data.design @ beta[:d]
    return left - beta[d] if data.bias else left


def _spread(outcome: Outcome) -> float:
    e, w = outcome.residual, outcome.weights
    weight = np.ones(len(e)) if w is None else w
    freedom = max(1.0 - outcome.solution.degrees / len(e), 1.0 / len(e))
    return float(np.sqrt(weight @ e**2 / (weight.sum() * freedom)))


def _covariance(data: Problem, outcome: Outcome, settings: Settings, sigma: float) -> FloatArray:
    bread, scale = outcome.solution.bread, data.all_scales
    if settings.covariance == "none":
        return np.zeros_like(bread)
    if settings.covariance == "iid":
        squares = np.ones(len(data.target)) if outcome.weights is None else outcome.weights
        middle = sigma**2 * _products(data, squares)
        return bread @ (middle / np.outer(scale, scale)) @ bread
    scores = _scores(data, outcome) if outcome.scores is None else outcome.scores
    rows = len(data.target)
    correction = rows / max(rows - outcome.solution.degrees, 1.0)
    middle = meat(scores, data.groups, settings.covariance, settings.lags) / np.outer(scale, scale)
    return correction * bread @ middle @ bread


def _products(data: Problem, factor: FloatArray) -> FloatArray:
    rows = with_ones(data) * factor[:, None]
    return rows.T @ rows


def _scores(data: Problem, outcome: Outcome) -> FloatArray:
    """Contribution x·w·e of each sample, in the units of the columns, (l, p)."""
    e = outcome.residual if outcome.weights is None else outcome.residual * outcome.weights
    scores = np.empty((len(e), data.columns))
    np.multiply(data.design, e[:, None], out=scores[:, : data.design.shape[1]])
    if data.bias:
        scores[:, -1] = e
    return scores


def _verdicts(
    theta: FloatArray, covariance: FloatArray, outcome: Outcome, settings: Settings
) -> tuple[BoolArray, tuple[str, ...]]:
    names = column_names(settings.names, len(theta))
    reasons = [""] * len(theta)
    if settings.covariance != "none":
        stderr = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        for i in np.flatnonzero(stderr > settings.max_relative_stderr * np.abs(theta)):
            reasons[i] = _uncertain(float(stderr[i]), float(theta[i]))
    for dependence in outcome.dependences:
        _explain(dependence, (*names, "the bias"), reasons, merged=outcome.merged)
    return np.array([not reason for reason in reasons]), tuple(reasons)


def _uncertain(stderr: float, value: float) -> str:
    share = f"{100 * stderr / abs(value):.3g} % of the value" if value else "and the value is zero"
    return f"its standard error is {stderr:.3g}, {share}"


def _explain(dependence: Dependence, names: tuple[str, ...], reasons: list[str], *, merged: bool) -> None:
    """Write the reason to every column that takes part."""
    column, others = dependence.column, dependence.others
    listed = " and ".join(names[k] for k in others)
    if not others:
        text = "it is zero throughout these data"
    elif merged:
        text = f"collinear with {listed} on these data: merged into it"
    else:
        text = f"collinear with {listed} on these data: only the penalty shares the coefficient out"
    if column < len(reasons):
        reasons[column] = text
    for k in (k for k in others if k < len(reasons)):
        reasons[k] = f"cannot be told from {names[column]} on these data" + (
            "; carries both" if merged else ""
        )
