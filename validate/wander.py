"""A drift of the position that a fit near the noise shows, known to the fits that go on from there.

Counted as so many times the noise, the slow errors of a receiver hide what is small; left as they are, a model that is
rich enough follows them. Known as what they are, they do neither.
"""

from __future__ import annotations

from dataclasses import replace

from identify.drift import Drift
from identify.fitted import SLOW, Fitted
from identify.kernel import POSITION
from identify.noise import calibrated, calibrated_anew, smoothness
from identify.parameter_covariance import reduction_of
from identify.wander import in_wander, likeliest_wander, wander_shown
from validate.refits import knowing, under

#: Above this cost per degree of freedom no drift is looked for.
TOO_FAR = 20.0
#: Errors of a position this much smoother than a drift (``identify.noise.smoothness``) are what the model lacks.
SMOOTH = 0.1
#: Steps after which a fit without a drift that was known is told it anew.
STEPS = 5


def with_wander_known(fitted: Fitted) -> Fitted:
    """The fit refitted with the drift of the position known that its errors show, if that is all that they show.

    As it was where the position does not drift, or its drift is known, or where with it the fit is still off the noise:
    far from it, what the model lacks moves the position as well. So does what it lacks where the errors are surely
    smoother than a receiver's (first-order Gauss-Markov): a current that changes within a campaign moves it evenly.
    """
    if fitted.problem.drifts or fitted.chi2_per_dof > TOO_FAR or not _position_slow(fitted) > SLOW:
        return fitted
    if smoothness(fitted.problem, fitted.solution.moments, POSITION) > SMOOTH:
        return fitted
    drift = likeliest_wander(fitted.problem, fitted.solution, reduction_of(fitted))
    if drift is None:
        return fitted
    found = _drifting(fitted, drift)
    at_noise = not found.is_off and _position_slow(found) < SLOW
    return found if at_noise else fitted


def with_wander_anew(fitted: Fitted) -> Fitted:
    """The fit with a drift that the errors of one before it showed told anew: part of it may be what was missing then.

    Without any where none is left; as it was where none was known so, or where the errors are smoother than a drift.
    """
    if wander_shown(fitted.problem) is None:
        return fitted
    bare = calibrated(replace(fitted.problem, stretches=in_wander(fitted.problem, None)), fitted.solution)
    without = under(bare, fitted, STEPS)
    without = under(calibrated_anew(bare, without.solution), without, STEPS)
    if not _position_slow(without) > SLOW and not without.is_off:
        return without
    if smoothness(without.problem, without.solution.moments, POSITION) > SMOOTH:
        return fitted
    drift = likeliest_wander(without.problem, without.solution, reduction_of(without))
    return fitted if drift is None else _drifting(without, drift)


def _drifting(fitted: Fitted, drift: Drift) -> Fitted:
    """The fit gone on with where a drift of the position is known."""
    return knowing(fitted, replace(fitted.problem, stretches=in_wander(fitted.problem, drift)))


def _position_slow(fitted: Fitted) -> float:
    """How many times their noise the slow errors of the position are."""
    return float(fitted.problem.dispersed.inflation[POSITION])
