"""Covariance of a solution's parameters: of correlated errors, and as large as errors of logs left out ask for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.first_states import state_precision
from identify.fitted import Fitted
from identify.input_sizes import untold
from identify.kernel import NX, POSITION
from identify.misfit import misfit_scale
from identify.output_error import Solution
from identify.shared_levels import shared_by_windows
from identify.wander import Reduction, moved_by_wander
from identify.windows import Problem, moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def covariance_of(fitted: Fitted) -> FloatArray:
    """Covariance (np, np) of all parameters, with errors as they are correlated (a sandwich).

    The fit weighs every stream by the size of its errors; their slow part counts more than white noise of that size
    would. Between two inverses of the information stands what the scores vary by. A drift of the position is told by
    its own size and time constant where it shows (``identify.wander``). Where logs were left out in turn, far from the
    noise, it is made as large as their errors ask for (``identify.misfit``). What lies anywhere between two values
    of an input has that uncertainty besides. Where windows were held one against the other it is as wide as they
    scatter (``identify.scattered``).
    """
    covariance, misfit = noise_and_misfit(fitted)
    return misfit**2 * covariance


def noise_and_misfit(fitted: Fitted) -> tuple[FloatArray, float]:
    """The covariance (np, np) near the noise, and how much larger logs left out ask for standard errors to be."""
    solution = fitted.solution
    covariance = _of_noise(fitted) + np.diag(untold(solution.structure, solution.p, fitted.problem.stretches))
    if not fitted.refits:
        return covariance if fitted.wider is None else covariance * np.outer(fitted.wider, fitted.wider), 1.0
    return covariance, misfit_scale(solution.structure, fitted.problem.stretches, fitted.refits, covariance)


def _of_prior_alone(information: FloatArray, prior: FloatArray) -> FloatArray:
    """Information (np, np) without what rounding alone made: of a prediction that all but runs away little is left."""
    lost = ~(np.diag(information) >= np.diag(prior))
    if not lost.any():
        return information
    return np.where(lost[:, None] | lost, prior, np.nan_to_num(information))


def _inverse(matrices: FloatArray) -> FloatArray:
    """Inverses of information matrices (w, k, k), however unlike the sizes of their parameters are."""
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(matrices, axis1=1, axis2=2), 1e-300))
    both = scale[:, :, None] * scale[:, None, :]
    return np.asarray(np.linalg.inv(matrices * both + 1e-13 * np.eye(matrices.shape[1])) * both, dtype=float)


def _of_noise(fitted: Fitted) -> FloatArray:
    """What the errors' size and their slow part make of the covariance (np, np)."""
    problem, solution = fitted.problem, fitted.solution
    known, prior = state_precision(solution.structure), np.diag(1.0 / fitted.prior.sd**2)
    reduction = reduction_of(fitted)
    through, inverse = reduction.through, reduction.inverse
    shared = shared_by_windows(problem, solution, through)
    if fitted.disturbed is not None:
        white = replace(problem, inflation=problem.inflation**2 / fitted.disturbed.left)
        varied = _matrices(white, solution) + fitted.disturbed.varied
        varied[:, range(NX), range(NX)] += known
        spread = (np.swapaxes(through, 1, 2) @ varied @ through).sum(axis=0) + prior
        spread = spread if shared is None else spread + shared
        return np.asarray(inverse @ spread @ inverse, dtype=float)
    moved = moved_by_wander(problem, solution, reduction)
    varied = _matrices(_counted(problem, drifts=moved is not None), solution)
    varied[:, range(NX), range(NX)] += known
    spread = (np.swapaxes(through, 1, 2) @ varied @ through).sum(axis=0) + prior
    spread = spread if shared is None else spread + shared
    return np.asarray(inverse @ spread @ inverse + (0.0 if moved is None else moved), dtype=float)


def reduction_of(fitted: Fitted) -> Reduction:
    """How first states and parameters of a fit answer to errors, by its own weights."""
    problem, solution = fitted.problem, fitted.solution
    plain = np.nan_to_num(_matrices(problem, solution))
    prior = np.diag(1.0 / fitted.prior.sd**2)
    states = _inverse(plain[:, :NX, :NX] + np.diag(state_precision(solution.structure)))
    slope = states @ plain[:, :NX, NX:]
    own = np.broadcast_to(np.eye(len(prior)), (len(slope), len(prior), len(prior)))
    through = np.concatenate([-slope, own], axis=1)
    information = (plain[:, NX:, NX:] - np.swapaxes(plain[:, :NX, NX:], 1, 2) @ slope).sum(axis=0) + prior
    information = _of_prior_alone(information, prior)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    inverse = np.linalg.pinv(information * scale * scale[:, None], rcond=1e-12) * scale * scale[:, None]
    return Reduction(states, through, inverse)


def _matrices(problem: Problem, solution: Solution) -> FloatArray:
    """Moments (w, 8 + np, 8 + np) of first states and parameters at a solution, under a problem's weights."""
    return moments(problem, solution.structure, solution.p, solution.first).matrices[:, :-1, :-1]


def _counted(problem: Problem, *, drifts: bool) -> Problem:
    """Weights under which the moments are what the scores vary by; of a position that drifts the white part alone."""
    inflation = problem.inflation / problem.dispersion
    if drifts:
        inflation[POSITION] = problem.inflation[POSITION] ** 2
    return replace(problem, inflation=inflation)
