"""Which of two searches came nearer to the noise, and whether what one leaves is worth another."""

from __future__ import annotations

import numpy as np

from identify.base_fit import CLEARLY, fit_states
from identify.fitted import FAR, NEAR, Fitted
from identify.free_running import free_running_errors
from identify.noise import calibrated
from identify.windows import cut
from validate.refits import under

#: A fit in longer windows than another that leaves so many times as much is no nearer for their length.
ASTRAY = 100.0
#: A fit is clearly nearer that leaves less than this share of the errors.
HALF = 0.5
#: Steps of a fit that is gone on with in shorter windows.
BUDGET = 40
#: Free runs whose errors are a smaller share of the motion, noise and all, leave nothing that matters.
MATERIAL = 0.1


def clearly_nearer(one: Fitted, other: Fitted, share: float = HALF) -> bool:
    """Whether a fit stays finite in longer windows than another, or leaves less than a share as much in equal ones.

    Finite is not enough where it leaves many times as much there: it runs away all the same.
    """
    if one.problem.length != other.problem.length:
        near = one.chi2_per_dof < ASTRAY * other.chi2_per_dof
        return one.problem.length > other.problem.length and near
    return one.chi2_per_dof < share * other.chi2_per_dof


def nearer_in_windows_alike(one: Fitted, other: Fitted) -> bool:
    """Whether a fit is clearly nearer than another that has windows no longer, in windows of the same length.

    Where nothing fits, windows in which a fit does not run away say little of it.
    """
    if one.problem.length > other.problem.length and one.is_far:
        problem = cut(one.problem.stretches, other.problem.length).weighted_as(one.problem)
        one = under(
            calibrated(problem, fit_states(problem, one.solution.structure, one.solution.p)), one, BUDGET
        )
    return clearly_nearer(one, other)


def worth_another(found: Fitted) -> bool:
    """Whether a fit is off the noise by what matters; farther off it another search would only take its time."""
    if found.chi2_per_dof < NEAR and not leaves_much(found):
        return False
    return found.is_off and found.chi2_per_dof < FAR


def leaves_much(fitted: Fitted) -> bool:
    """Whether free runs of the logs leave what matters, noise and all."""
    return bool(np.any(free_running_errors(fitted) > MATERIAL**2))


def as_near(one: Fitted, other: Fitted) -> bool:
    """Whether a fit is no farther from the noise than another, over windows as long."""
    return one.problem.length >= other.problem.length and one.chi2_per_dof <= other.chi2_per_dof


def came_there(one: Fitted, other: Fitted) -> bool:
    """Whether a fit came to the noise where another did not, or is clearly nearer."""
    if clearly_nearer(one, other, CLEARLY):
        return True
    return as_near(one, other) and other.is_off and not one.is_off
