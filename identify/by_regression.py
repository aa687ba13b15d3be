"""Fit a structure with one of the regression estimators, on the smoothed states."""

from __future__ import annotations

import numpy as np

from identify.base_fit import Fitted, null_parameters, window_length
from identify.estimators import ESTIMATORS
from identify.output_error import Prior, solve
from identify.prepare import Prepared
from identify.regression import accelerations, regressors
from identify.windows import cut, first_states

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def fit_by_regression(prepared: Prepared, estimator: str, **options: float) -> tuple[Fitted, FloatArray, str]:
    """Coefficients by regression, one equation after the other.

    Returns
    -------
    fitted : Fitted
        With the coefficients fixed and only the windows' first states fitted.
    covariance : (np, np)
        As the estimator gives it, corrected for correlated residuals.
    stopped : str
        How the estimation ended.
    """
    structure, stretches = prepared.structure, prepared.identify
    p = null_parameters(structure)
    design = np.vstack([regressors(structure, p, s) for s in stretches])
    target = np.vstack([accelerations(s) for s in stretches])
    groups = np.repeat(np.arange(len(stretches)), [s.steps for s in stretches])
    covariance, stopped = np.zeros((len(p), len(p))), ""
    for equation in range(3):
        mine = [
            k for k, s in enumerate(structure.slots)
            if s.coefficient >= 0 and structure.table.equation_of[s.coefficient] == equation
        ]  # fmt: skip
        if mine:
            columns = [structure.slots[k].coefficient for k in mine]
            found = ESTIMATORS[estimator].fit(
                design[:, columns], target[:, equation], groups=groups, **options
            )
            p[mine], covariance[np.ix_(mine, mine)] = np.nan_to_num(found.theta), found.covariance
            stopped = found.stopped
    problem = cut(stretches, window_length(structure.vessel.length))
    fixed = Prior(p, np.full(len(p), 1e-9))
    solution = solve(problem, structure, p, first_states(problem), fixed, budget=8)
    return Fitted(problem, fixed, solution), covariance, stopped
