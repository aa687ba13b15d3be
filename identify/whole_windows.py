"""A fit at the noise gone on with over whole logs: every first state that is free costs."""

from __future__ import annotations

import numpy as np

from identify.braked import braked
from identify.disturbance import with_disturbances
from identify.first_states import first_states
from identify.fitted import NEAR, Fitted
from identify.in_common import in_common
from identify.noise import calibrated
from identify.output_error import solve
from identify.parameter_covariance import covariance_of
from identify.scattered import with_scatter
from identify.windows import cut
from preprocess.cores import side_by_side


def sharpest(fitted: Fitted) -> Fitted:
    """A fit, at the noise over whole logs; its errors count what pushed the vessel unlogged, and windows' scatter."""
    fitted = braked(fitted)
    ways = (with_disturbances, _pushed_over_whole_logs)
    pushed, found = side_by_side(lambda way: way(fitted), ways, shared=in_common(fitted))
    return found if found.refits else with_scatter(found, pushed, covariance_of(pushed))


def _pushed_over_whole_logs(fitted: Fitted) -> Fitted:
    """The fit over whole logs, with what its errors show of pushes."""
    return with_disturbances(over_whole_logs(fitted))


def over_whole_logs(fitted: Fitted) -> Fitted:
    """The fit gone on with over whole logs, where the model is at the noise: every first state that is free costs.

    Windows of half a minute give away a third of what the logs tell of some coefficients. Where whole logs would not be
    fitted as well, the model lacks something, and the fit stays as it was. So it does where anything is hidden.
    """
    return fitted.remembered(_over_whole_logs)


def _over_whole_logs(fitted: Fitted) -> Fitted:
    """The same, made anew."""
    if _is_whole(fitted) or fitted.chi2_per_dof > NEAR or fitted.problem.hides:
        return fitted
    found = as_a_whole(fitted)
    at_noise = found is not None and found.chi2_per_dof < NEAR and found.problem.inflation.max() < NEAR
    return found if found and at_noise else fitted


def as_a_whole(fitted: Fitted) -> Fitted | None:
    """The fit gone on with over whole logs, whatever it comes to; None where it runs away."""
    return fitted.remembered(_as_a_whole)


def _as_a_whole(fitted: Fitted) -> Fitted | None:
    """The same, made anew."""
    if _is_whole(fitted):
        return fitted
    problem = cut(fitted.problem.stretches, np.inf).weighted_as(fitted.problem)
    structure, first = fitted.solution.structure, first_states(problem)
    solution = solve(problem, structure, fitted.solution.p, first, fitted.prior, budget=15)
    if not np.isfinite(solution.cost):
        return None
    problem = calibrated(problem, solution)
    solution = solve(problem, structure, solution.p, solution.first, fitted.prior, anchor=first, budget=10)
    return Fitted(problem, fitted.prior, solution)


def _is_whole(fitted: Fitted) -> bool:
    return len(fitted.problem.windows) == len(fitted.problem.stretches)
