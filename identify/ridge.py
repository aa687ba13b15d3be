"""How large coefficients may be beforehand: as the logs themselves are likeliest with.

A rich model that has seen one rudder angle cannot tell a force in δ from one in |δ|δ. Two coefficients a hundred times
their size then cancel each other on the logs that were fitted, and run away on the next. How tight a ridge keeps them
is a matter of evidence: the likelihood with all coefficients integrated out (MacKay 1992), which a fit near the noise
has from its own information. What the logs determine well stays where it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.first_states import first_states
from identify.fitted import FAR, Fitted
from identify.output_error import RIDGE, prior_for, solve
from identify.regression import coefficient_scales

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Ridges that are looked at, in natural sizes of the coefficients.
RIDGES = (3.0, 10.0, RIDGE)
#: Steps of the search that goes on with another ridge.
BUDGET = 15


def with_likeliest_ridge(fitted: Fitted) -> Fitted:
    """A fit near the noise gone on with under the ridge of the greatest evidence; another fit as it is."""
    if not fitted.chi2_per_dof < FAR:
        return fitted
    s, problem = fitted.solution, fitted.problem
    scales = coefficient_scales(s.structure, s.p, problem.stretches)
    priors = [prior_for(s.structure, scales, r) for r in RIDGES]
    best = min(priors, key=lambda prior: doubt(fitted, prior.sd))
    if best.ridge == fitted.prior.ridge:
        return fitted
    p = s.p + _move(fitted, best.sd)
    found = solve(problem, s.structure, p, s.first, best, anchor=first_states(problem), budget=BUDGET)
    return replace(fitted, prior=best, solution=found) if np.isfinite(found.cost) else fitted


def doubt(fitted: Fitted, sd: FloatArray) -> float:
    """−2 log evidence, up to a constant, for coefficients known beforehand to standard deviations ``sd`` (np,).

    To second order about the fit. What is no coefficient keeps its own prior, and is at its best.
    """
    s, prior, move = fitted.solution, fitted.prior, _move(fitted, sd)
    information, pull = _said(fitted)
    old, away = 1.0 / prior.sd**2, s.p - prior.mean
    cost = move @ information @ move - 2.0 * pull @ move + np.sum(((away + move) / sd) ** 2)
    mine = np.array([slot.coefficient >= 0 for slot in s.structure.slots])
    others = information[np.ix_(~mine, ~mine)] + np.diag(old[~mine])
    across = information[np.ix_(~mine, mine)]
    left = information[np.ix_(mine, mine)] - across.T @ np.linalg.lstsq(others, across)[0]
    scaled = sd[mine][:, None] * left * sd[mine]
    return float(cost + np.linalg.slogdet(np.eye(len(scaled)) + scaled)[1])


def _move(fitted: Fitted, sd: FloatArray) -> FloatArray:
    """How far the parameters (np,) move where they are known beforehand to ``sd`` instead."""
    information, pull = _said(fitted)
    pull = pull - (fitted.solution.p - fitted.prior.mean) / sd**2
    return np.asarray(np.linalg.lstsq(information + np.diag(1.0 / sd**2), pull)[0], dtype=float)


def _said(fitted: Fitted) -> tuple[FloatArray, FloatArray]:
    """What the logs say of the parameters (np, np), and how they pull at them (np,) against what was known beforehand.

    Off the noise both are so much less as the errors are larger than it.
    """
    s, off = fitted.solution, max(1.0, fitted.chi2_per_dof)
    pull = (s.p - fitted.prior.mean) / fitted.prior.sd**2
    return s.reduced.information.sum(axis=0) / off, pull / off
