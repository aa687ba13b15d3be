"""A fit at the noise gone on with over whole logs: every first state that is free costs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from identify.braked import braked
from identify.disturbance import with_disturbances
from identify.first_states import first_states
from identify.fitted import NEAR, SLOW, Fitted
from identify.free_running import is_lost
from identify.in_common import in_common
from identify.noise import calibrated
from identify.output_error import solve
from identify.parameter_covariance import covariance_of
from identify.scattered import with_scatter
from identify.settled import settled
from identify.windows import cut
from preprocess.cores import side_by_side

#: Steps of a fit over longer windows.
LONGER = 20
#: Values from whole logs are as near in windows where chance takes them farther in fewer than this share of cases.
BY_CHANCE = 1e-3


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
    return found if found and at_noise and as_quick(found, fitted) else fitted


def as_quick(whole: Fitted, fitted: Fitted) -> bool:
    """Whether errors over whole logs are no slower than over windows, positions among them.

    What adds up over a log (a rudder logged to a tenth of a degree) is no noise of the sensors, and parameters bend to
    it by more than they say.
    """
    slow, before = (f.problem.dispersed.inflation for f in (whole, fitted))
    return bool((slow < SLOW * np.maximum(before, 1.0)).all())


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


def steadied(fitted: Fitted) -> Fitted:
    """A fit that is lost over its own logs with values that it is not lost with, where its windows are as near so.

    What windows hardly tell (the sway of a vessel whose receiver is coarse) may have any value in them, one that drives
    a free run too. Logs tell more of it the longer they are followed: over windows twice as long each time.
    """
    if fitted.chi2_per_dof > NEAR or not is_lost(fitted):
        return fitted
    longer = _followed_longer(braked(fitted))
    if longer is None or longer.chi2_per_dof > NEAR:
        return fitted
    s, p = fitted.solution, longer.solution.p
    first, anchor = settled(fitted.problem, s.structure, p).first, first_states(fitted.problem)
    found = solve(fitted.problem, s.structure, p, first, fitted.prior, anchor=anchor, budget=0)
    steady = replace(fitted, solution=found)
    as_near = found.total - s.total < float(chi2.isf(BY_CHANCE, len(p)))
    return steady if as_near and not is_lost(steady) else fitted


def _followed_longer(fitted: Fitted) -> Fitted | None:
    """The fit gone on with over windows twice as long, and again, up to whole logs; None where it runs away."""
    structure, longest = fitted.solution.structure, max(s.steps * s.h for s in fitted.problem.stretches)
    while fitted.problem.length < longest:
        problem = cut(fitted.problem.stretches, 2.0 * fitted.problem.length).weighted_as(fitted.problem)
        p, anchor = fitted.solution.p, first_states(problem)
        first = settled(problem, structure, p).first
        solution = solve(problem, structure, p, first, fitted.prior, anchor=anchor, budget=LONGER)
        if not np.isfinite(solution.cost):
            return None
        fitted = replace(fitted, problem=problem, solution=solution)
    return fitted


def _is_whole(fitted: Fitted) -> bool:
    return len(fitted.problem.windows) == len(fitted.problem.stretches)
