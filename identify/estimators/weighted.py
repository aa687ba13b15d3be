"""Weighted least-squares support vector regression: weights set once, or adapted until they settle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike

from .estimate import Common, Estimate, FloatArray, Settings
from .judge import Outcome, estimate, residuals
from .lssvm import Machine, solve_machine
from .problem import Problem, problem, with_ones
from .solve import Solution, dependences

NORMAL = 1.4826  # standard deviation of a normal variable over its median absolute deviation


def fit_wls_svr(
    design: ArrayLike,
    target: ArrayLike,
    *,
    groups: ArrayLike | None = None,
    C: float = 1e6,
    bias: bool = True,
    scaled: bool = True,
    form: Literal["primal", "dual"] = "primal",
    **common: Unpack[Common],
) -> Estimate:
    """LS-SVR, then once more with the weights that its errors give (Zhu et al. 2019, eq. 19-24, with |e|)."""
    settings, machine = Settings(**common), Machine(C, 0.0, scaled, form)
    data = problem(design, target, groups, bias=bias)
    first, factor = solve_machine(data, machine)
    before = residuals(data, first.beta)
    weights = adaptive_weights(before)
    solution, _ = solve_machine(data, machine, weights)
    residual = residuals(data, solution.beta)
    scores = (
        None if settings.covariance in ("none", "iid") else _one_step_scores(data, before, first, residual)
    )
    run = _Run(solution, residual, weights, "Weighted once by the errors of the unweighted fit.")
    return _conclude(data, machine, settings, run, factor, scores)


def fit_rw_lssvr(
    design: ArrayLike,
    target: ArrayLike,
    *,
    groups: ArrayLike | None = None,
    C: float = 1e6,
    bias: bool = True,
    scaled: bool = True,
    form: Literal["primal", "dual"] = "primal",
    least_change: float = 1e-6,
    iterations: int = 200,
    **common: Unpack[Common],
) -> Estimate:
    """LS-SVR with weights adapted until they settle (Zhu et al. 2019, IV.A; Zhu et al. 2022, eq. 23-27).

    Parameters
    ----------
    least_change : float
        Mean absolute change of the weights at which they count as settled (E_min per sample).
    iterations : int
        Most reweightings.
    """
    settings, machine = Settings(**common), Machine(C, 0.0, scaled, form)
    data = problem(design, target, groups, bias=bias)
    run, factor = _iterate(data, machine, least_change, iterations)
    bread = _curvature_bread(data, run)
    if bread is not None:
        run = _Run(
            Solution(run.solution.beta, bread, run.solution.degrees), run.residual, run.weights, run.stopped
        )
    return _conclude(data, machine, settings, run, factor, None)


@dataclass(frozen=True)
class _Run:
    solution: Solution
    residual: FloatArray
    weights: FloatArray
    stopped: str


def pseudo_median(error: FloatArray) -> float:
    """Scale T' of the errors: mean of the medians of their second and third quarters (eq. 24, of |e|)."""
    quarter = len(error) // 4
    if quarter == 0:
        return float(np.median(np.abs(error)))
    middle = [(a + b) // 2 for a, b in ((2 * quarter, 4 * quarter), (4 * quarter, 6 * quarter))]
    places = [middle[0] // 2, (middle[0] - 1) // 2, middle[1] // 2, (middle[1] - 1) // 2]
    return float(np.mean(np.partition(np.abs(error), places)[places]))


def adaptive_weights(error: FloatArray) -> FloatArray:
    """Weights 2 / (1 + exp(|e| / T')) (eq. 23, with |e|: as printed, large negative errors gain weight)."""
    return _weights(error, pseudo_median(error))


def _weights(error: FloatArray, scale: float) -> FloatArray:
    if scale <= 0.0:
        return np.where(error == 0.0, 1.0, 0.0) if np.any(error) else np.ones_like(error)
    return np.asarray(2 / (1 + np.exp(np.minimum(np.abs(error) / scale, 700.0))))


def _weights_slope(error: FloatArray, scale: float) -> FloatArray:
    """Differentiate the weight by |e|, and multiply by |e|."""
    if scale <= 0.0:
        return np.zeros_like(error)
    ratio = np.minimum(np.abs(error) / scale, 300.0)
    growth = np.exp(ratio)
    return np.asarray(-2 * ratio * growth / (1 + growth) ** 2)


def _iterate(
    data: Problem, machine: Machine, least_change: float, iterations: int
) -> tuple[_Run, FloatArray]:
    solution, factor = solve_machine(data, machine)
    floor = 1e-12 * float(np.sqrt(np.mean(data.target**2)))
    weights: FloatArray = np.ones(len(data.target))
    for count in range(1, iterations + 1):
        residual = residuals(data, solution.beta)
        if float(np.max(np.abs(residual))) <= floor:
            return _Run(solution, residual, weights, "The errors are at rounding; nothing to weigh."), factor
        updated = _weights(residual, max(pseudo_median(residual), floor))
        change = float(np.mean(np.abs(updated - weights)))
        weights = updated
        solution, _ = solve_machine(data, machine, weights)
        if change <= least_change:
            text = f"The weights settled after {count} reweightings."
            return _Run(solution, residuals(data, solution.beta), weights, text), factor
    text = f"Stopped at {iterations} reweightings; the weights still changed by {change:.1e}."
    return _Run(solution, residuals(data, solution.beta), weights, text), factor


def _curvature_bread(data: Problem, run: _Run) -> FloatArray | None:
    """Invert Σ ψ'(e) x x', ψ = w(e) e: how the settled estimate answers to the data; None if indefinite."""
    shortfall = _weights_slope(run.residual, pseudo_median(run.residual))
    rows, units = with_ones(data), data.all_scales
    change = (rows * shortfall[:, None]).T @ rows / np.outer(units, units)
    curvature = np.linalg.inv(run.solution.bread) + change
    if np.linalg.eigvalsh(curvature)[0] <= 0.0:
        return None
    return np.asarray(np.linalg.inv(curvature))


def _one_step_scores(data: Problem, before: FloatArray, first: Solution, residual: FloatArray) -> FloatArray:
    """Influence of each sample on the once-weighted fit, that through the weights included.

    With e₀ the errors of the first fit, Σ x w(e₀) (y - xβ) = 0 moves with the sample itself and, through
    e₀, with the first fit: x w e + M A₀⁻¹ x e₀, M = -Σ w'(e₀) e x x'.
    """
    rows, units = with_ones(data), data.all_scales
    scale = pseudo_median(before)
    slope = _weights_slope(before, scale) * np.divide(
        residual, before, out=np.ones_like(before), where=before != 0
    )
    through = -(rows * slope[:, None]).T @ rows @ (first.bread / np.outer(units, units))
    own = rows * (_weights(before, scale) * residual)[:, None]
    return own + (rows * before[:, None]) @ through.T


def _conclude(
    data: Problem,
    machine: Machine,
    settings: Settings,
    run: _Run,
    factor: FloatArray,
    scores: FloatArray | None,
) -> Estimate:
    _, dropped = dependences(factor, settings.tolerance)
    outcome = Outcome(
        run.solution,
        run.residual,
        dropped,
        run.stopped,
        weights=run.weights,
        scores=scores,
        merged=False,
        sigma=NORMAL * float(np.median(np.abs(run.residual))),
        hyper={"C": machine.C},
    )
    return estimate(data, outcome, settings)
