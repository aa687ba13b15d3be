"""Headings that are off slowly by no more than those of any compass: known to be so in the fit, and no structure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.drift import Drift
from identify.fitted import FAR, SLOW, Fitted
from identify.kernel import HEADING
from identify.wander import drifts_shown, with_drifts
from validate.refits import knowing

#: By so much any compass is off, rad (the least that will do), and for about so long, s.
ANY_COMPASS, LASTING = np.radians((0.1, 0.2)), 15.0
#: Told anew with the noise, that may become so many times as much.
GROWN = 1.25


def with_slight_compass_known(fitted: Fitted) -> Fitted:
    """The fit refitted with headings that drift by as little as any do, if that leaves nothing off the noise.

    Counted as so many times their white noise such errors would be sought a cause for. As it was far from the noise,
    where headings are not slowly off, where a drift of theirs is known, and where it is not all.
    """
    problem = fitted.problem
    drifts = any(d.kind == HEADING for s in problem.stretches for d in s.drifts)
    if drifts or fitted.chi2_per_dof > FAR or not _slow(fitted) > SLOW:
        return fitted
    for size in ANY_COMPASS:
        drift = Drift(float(size), LASTING, HEADING, shown=True)
        known = with_drifts(problem.stretches, [*drifts_shown(problem), drift])
        found = knowing(fitted, replace(problem, stretches=known))
        if not found.is_off and _size(found) < GROWN * size:
            return found
    return fitted


def _size(fitted: Fitted) -> float:
    """Standard deviation of the headings' drift, rad."""
    return max(d.size for d in drifts_shown(fitted.problem) if d.kind == HEADING)


def _slow(fitted: Fitted) -> float:
    """How many times their noise the slow errors of the heading are."""
    return float(fitted.problem.dispersed.inflation[HEADING])
