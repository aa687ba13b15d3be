"""What pushes the vessel and no log says, known to a fit whose errors show it: what else is missing shows beside it.

Gusts, seaways and wash add up over a window to many times the sensors' noise. Counted as so many times that noise, they
hide whatever moves the vessel by less. With their own covariance (``identify.disturbance``) the errors are white, and a
cause that comes at the right moments stands out of pushes that come at any.
"""

from __future__ import annotations

from dataclasses import replace

from identify.disturbance import with_disturbances
from identify.disturbed import Sizes
from identify.fitted import FAR, NEAR, Fitted
from identify.noise import calibrated_anew
from identify.output_error import Prior
from identify.unlogged import nothing_hidden, with_pushes
from identify.windows import Problem
from validate.refits import under

#: A fit under new weights is refitted so many times.
ROUNDS = 2
#: Pushes are believed that leave no more than this share of the largest slow error.
SHARE = 0.6


def with_pushes_known(fitted: Fitted) -> Fitted:
    """The fit refitted with the pushes known that its errors are likeliest with, if these are all that they show.

    As it was at the noise and far from it, where pushes are known, and where much of what is slow is left with them.
    """
    if not fitted.is_off or fitted.chi2_per_dof > FAR or fitted.problem.pushes:
        return fitted
    disturbed = with_disturbances(replace(fitted, refits=())).disturbed
    if disturbed is None:
        return fitted
    found = fitted
    for _ in range(ROUNDS):
        found = under(_pushed(found, disturbed.sizes), found, 20)
    before, after = (float(f.problem.dispersed.inflation.max()) for f in (fitted, found))
    return found if found.chi2_per_dof < NEAR and after < SHARE * before else fitted


def with_pushes_anew(fitted: Fitted) -> Fitted:
    """The fit with pushes that were known told anew: part of them may be what was missing then.

    Without any at the noise; as it was where none were known, or none account for the errors any more.
    """
    if fitted.problem.pushes is None:
        return fitted
    bare = without_pushes(fitted)
    bare = under(calibrated_anew(bare.problem, bare.solution), replace(bare, prior=fitted.prior), 20)
    if not bare.is_off:
        return bare
    found = with_pushes_known(bare)
    return fitted if found is bare else found


def without_pushes(fitted: Fitted) -> Fitted:
    """The same parameters, held, by the sensors' noise alone; as it was where no pushes are known."""
    known = fitted.problem.unlogged
    if known is None or known.pushes is None:
        return fitted
    held = replace(fitted, prior=Prior.held(fitted.solution.p))
    left = replace(known, pushes=None, pushed=None)
    bare = replace(fitted.problem, unlogged=left if left.parts else None)
    for _ in range(ROUNDS):
        held = under(bare, held, 20)
        bare = calibrated_anew(bare, held.solution)
    return under(bare, held, 20)


def _pushed(fitted: Fitted, sizes: Sizes) -> Problem:
    """A fit's problem with pushes of some sizes known, its noise as the errors are with them."""
    problem, s = fitted.problem, fitted.solution
    known = problem.unlogged or replace(nothing_hidden(problem, s.structure, s.p), share=0.0)
    there = replace(problem, unlogged=with_pushes(problem, known.over(problem), sizes))
    return calibrated_anew(there, s)
