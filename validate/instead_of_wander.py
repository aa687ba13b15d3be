"""A cause in place of the drift of the position that a fit without it showed.

What moves positions slowly, an antenna that stands elsewhere or a weak current, shows as a drift of the receiver's
until it is known; and once that drift is known the cause explains little more, and of use to a free run it is none.
"""

from __future__ import annotations

from collections.abc import Sequence

from identify.fitted import Fitted
from identify.noise import calibrated
from identify.parameter_covariance import reduction_of
from identify.wander import gain_of_wander, wander_shown
from validate.consistency import consistent
from validate.judgement import Judged, added_parameters, at_bound, least_gain, significance
from validate.refits import under
from validate.score_scatter import scatter
from validate.wander import with_wander_anew

#: So many of the causes are asked that gain beside the drift what chance alone would not give one of them.
ASKED = 2
#: Steps in which the fit without a cause is told that nothing drifts.
STEPS = 20


def instead_of_wander(base: Fitted, judged: Sequence[Judged], tried: int) -> Judged | None:
    """What leaves no drift to be seen, and is likelier than a drift is without; None where none of the judged is that.

    ``tried`` candidates were looked at.
    """
    if wander_shown(base.problem) is None:
        return None
    likely = [j for j in judged if j.gain > least_gain(j.parameters, 1) and not at_bound(j.fitted)]
    found = [
        instead
        for j in likely[:ASKED]
        if consistent(base, j.fitted) and (instead := _without_wander(base, j, tried))
    ]
    return max(found, key=lambda j: j.evidence, default=None)


def _without_wander(base: Fitted, judged: Judged, tried: int) -> Judged | None:
    """A cause judged against a drift of the position that stands in its place; None where that is as likely."""
    fitted = with_wander_anew(judged.fitted)
    if wander_shown(fitted.problem) is not None:
        return None
    bare = under(fitted.problem, base, STEPS)
    seen = calibrated(bare.problem, bare.solution)
    there = under(seen, bare, 0)
    drift = gain_of_wander(seen, there.solution, reduction_of(there))
    gain, k = bare.solution.total - fitted.solution.total - drift, added_parameters(bare, fitted)
    by_chance = scatter(fitted, len(fitted.solution.structure.actives) - 1)
    evidence = gain / by_chance.ratio - least_gain(k, tried, by_chance.degrees)
    if evidence <= 0.0:
        return None
    return Judged(judged.screened, fitted, gain, k, significance(gain, k, tried, by_chance), evidence)
