"""Refit the finalists and judge them by the likelihood of the raw measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from identify import kernel
from identify.first_states import first_states
from identify.fitted import FAR, NEAR, Fitted
from identify.free_running import free_running_misfit
from identify.in_common import in_common
from identify.noise import calibrated, dispersed_cost, recalibrated
from identify.output_error import solve
from identify.structure import Structure
from identify.windows import Problem
from preprocess.cores import side_by_side
from validate.anew import anew
from validate.candidates import Screened, smooth
from validate.consistency import consistent, gains_by_time, stands_out
from validate.hidden_share import accounted_for
from validate.log_groups import free_in_logs, in_likeliest_logs
from validate.pace import Pace
from validate.refits import (
    STRAYS,
    best_first,
    converges,
    raced,
    step_tolerance,
    target_gap,
    under,
)
from validate.score_scatter import Scatter, scatter
from validate.search_ends import THE_SAME
from validate.swell import with_waves_known

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: An effect is taken where chance would give its gain in fewer than this share of campaigns that lack nothing.
FALSE_ALARM = 0.01
#: Evidence of less than this leaves a doubt about what is of no use to a free run.
DOUBTFUL = 100.0
#: Two causes whose costs differ by less than this cannot be told apart (odds of 20 to 1).
INDISTINCT = 6.0
#: An effect must lower the free-running error on the logs it was found on by this share to be worth naming.
WORTH = 0.02
#: ... and what lowers it by this share is not from a few places: a free run over a whole log adds up all there is.
CLEARLY = 0.5
#: By this share free-running errors over whole logs may grow by chance when parameters move within their uncertainty.
BY_CHANCE = 0.25
#: Off the noise, so many of the best candidates are fitted again from the beginning.
AGAIN = 3
#: Steps of the fits with candidates, and without, under the weights of the best: of two that are not at their best the
#: difference says nothing.
SETTLED = 30
#: Errors have structure worth a name from this much variance at low frequency beyond white noise.
COLOURED = 0.2
#: As long as the model stays far from the noise, a candidate must take away this share of the cost: what takes less
#: only borrows from what is really missing.
WORTH_FAR = 0.3
#: ... or, in units of the sensors' own noise, this share is left: errors of one stream may be most of that.
NEARER = 0.5


@dataclass(frozen=True)
class Judged:
    """A finalist after its refit.

    ``gain`` in -2 log likelihood over the model without it, ``parameters`` how many it adds, ``p_value`` counting the
    candidates tried, ``evidence`` the gain less what chance would give, both as far as the windows' scatter allows.
    """

    screened: Screened
    fitted: Fitted
    gain: float
    parameters: int
    p_value: float
    evidence: float

    @property
    def label(self) -> str:
        """The candidate's label."""
        return self.screened.active.label


def added_parameters(without: Fitted, with_it: Fitted) -> int:
    """Number of parameters that an effect adds."""
    return max(1, len(with_it.solution.p) - len(without.solution.p))


def parameters_of(structure: Structure, index: int) -> int:
    """Number of parameters that an effect of a structure adds.

    Where the inputs have a clock of their own, they are not ahead of it as well: it adds one all the same.
    """
    return max(1, len(structure.slots) - len(structure.without(index).slots))


def judge(
    base: Fitted, finalists: Sequence[Screened], tried: int, pace: Pace | None = None, choices: int = 0
) -> tuple[Fitted, list[Judged]]:
    """Refit the finalists, weigh errors as the best of them leaves them, and judge; the best first.

    ``tried`` candidates were looked at, and so many ``choices`` of logs besides of what is in some of them. Returns the
    fit without them under the same weights, and the judged finalists.
    """
    pace = pace or Pace()
    refitted = _in_their_logs(base, raced(base, finalists, pace))
    if not refitted:
        return base, []
    if not converges(base):
        refitted = best_first(refitted, base)
        pace.expect(2 * AGAIN + 1, pace.left)
        best_few = [f for _, f in refitted[:AGAIN]]
        again = side_by_side(anew, best_few, lambda f: pace(f"anew: {_last(f)}"), in_common(*best_few))
        refitted = [(s, f) for (s, _), f in zip(refitted, again, strict=False)] + refitted[AGAIN:]
    pace("without what did best")
    best = best_first(refitted, base)[0][1]
    base = better_base(base, best)
    far = base.chi2_per_dof > FAR
    weights = _weights_of(best)
    base_there = under(weights, base, SETTLED)
    reach = np.inf if far else best.solution.total + 0.5 * target_gap(base, best)
    near = [(s, under(weights, f, SETTLED)) for s, f in refitted if f.solution.total < reach]
    known = 0.0 if far else accounted_for(base, base_there)
    structure = base.solution.structure
    judged = [
        judged_under(base_there, s, f, tried + choices * free_in_logs(s.active, structure), known)
        for s, f in near
    ]
    return base_there, sorted(judged, key=lambda j: j.fitted.astray_by if far else _unlikely(j))


def _weights_of(best: Fitted) -> Problem:
    """The windows weighed as the best refit leaves their errors, and the waves in them as they show beside it.

    Waves that were seen without it were given what it explains, as far as they could be: with them it gains little.
    """
    again = best if best.problem.swell is None or best.is_far else with_waves_known(best)
    alike = len(again.problem.windows) == len(best.problem.windows)
    return recalibrated(again.problem, again.solution) if alike else recalibrated(best.problem, best.solution)


def _unlikely(judged: Judged) -> tuple[bool, float]:
    """Order of what is left to take: of all that chance does not give the likeliest first (Akaike 1974).

    Whether a gain is chance is said by its own scatter; which of two that are none is the cause, by the likelihood.
    """
    return judged.evidence <= 0.0, 2.0 * judged.parameters - judged.gain


def _in_their_logs(base: Fitted, refitted: list[tuple[Screened, Fitted]]) -> list[tuple[Screened, Fitted]]:
    """The refits, best first; of an effect in some logs the best one is in those that the measurements want.

    Where the best of all is at the noise, the others' logs need not be asked for: what could stand in its place is
    asked later.
    """
    found: list[tuple[Screened, Fitted]] = []
    seen: set[str] = set()
    settled = bool(refitted) and refitted[0][1].chi2_per_dof < NEAR < base.chi2_per_dof
    for screened, fit in refitted:
        name = screened.active.effect.name
        promises = fit.solution.total < base.solution.total - INDISTINCT and name not in seen
        promises = promises and not (settled and found)
        found.append((screened, in_likeliest_logs(fit, INDISTINCT) if promises else fit))
        seen.add(name)
    return best_first(found, base)


def _last(fitted: Fitted) -> str:
    """Label of the effect that was added last."""
    return fitted.solution.structure.actives[-1].label


def better_base(base: Fitted, candidate: Fitted) -> Fitted:
    """The fit without the candidate, begun anew from where the candidate ended.

    A base that is not at its best would let any candidate gain.
    """
    structure = base.solution.structure
    p = structure.carried(candidate.solution.p, candidate.solution.structure)
    found = solve(
        base.problem, structure, p, candidate.solution.first, base.prior, anchor=first_states(base.problem),
        budget=15, tolerance=step_tolerance(base),
    )  # fmt: skip
    return replace(base, solution=found) if found.total < base.solution.total else base


def judged_under(base: Fitted, screened: Screened, fit: Fitted, tried: int, known: float = 0.0) -> Judged:
    """What speaks for a refit, less what is ``known`` to account for as much without it."""
    gain = dispersed_cost(base.problem, base.solution) - dispersed_cost(base.problem, fit.solution) - known
    k, by_chance = added_parameters(base, fit), scatter(fit, len(fit.solution.structure.actives) - 1)
    evidence = gain / by_chance.ratio - least_gain(k, tried, by_chance.degrees)
    return Judged(screened, fit, gain, k, significance(gain, k, tried, by_chance), evidence)


def significance(gain: float, k: int, tried: int, by_chance: Scatter) -> float:
    """Probability that chance alone gives one of ``tried`` candidates with ``k`` parameters this gain."""
    each = max(gain, 0.0) / by_chance.ratio / k
    known = np.isfinite(by_chance.degrees)
    single = float(stats.f.sf(each, k, by_chance.degrees) if known else stats.chi2.sf(k * each, k))
    return float(-np.expm1(tried * np.log1p(-min(single, 1 - 1e-16))))


def least_gain(k: int, tried: int, degrees: float = np.inf) -> float:
    """Gain that chance gives in a share ``FALSE_ALARM`` of campaigns, ``tried`` candidates looked at.

    In units of what it is times chi-squared by chance, where that is known from so many degrees of freedom.
    """
    share = FALSE_ALARM / max(tried, 1)
    return float(k * stats.f.isf(share, k, degrees) if np.isfinite(degrees) else stats.chi2.isf(share, k))


def worthwhile(base: Fitted, fit: Fitted) -> bool:
    """Whether the free-running error falls by enough to be worth naming the effect, or its structure goes with it.

    Free runs are held against the smoothed motion. Where that is mostly noise (a sway of millimetres a second) they
    say less than the measurements: what brings these to the noise, and takes their structure along, is worth a name.
    """
    if base.chi2_per_dof > FAR:
        less = fit.solution.cost < (1.0 - WORTH_FAR) * base.solution.cost
        nearer = fit.chi2_per_dof < max(FAR, NEARER * base.chi2_per_dof)
        return bool((nearer or less) and not at_bound(fit))
    if at_bound(fit):
        return False
    before, after = free_running_misfit(base), free_running_misfit(fit)
    if after < (1.0 - CLEARLY) ** 2 * before:
        return True
    if not consistent(base, fit):
        return False
    if after < (1.0 - WORTH) ** 2 * before:
        return True
    to_the_noise = fit.chi2_per_dof < NEAR < base.chi2_per_dof
    return (to_the_noise or after < (1.0 + BY_CHANCE) * before + 0.01) and whitened(base, fit)


def beyond_doubt(base: Fitted, judged: Judged) -> bool:
    """Whether an effect is measured near the noise beyond any doubt, be it of no use to a free run.

    Left out, it would bend what stands in for it, and tell two causes apart that are one. Where slow errors stay that
    are many times the noise, something else is missing, and a small effect may be no more than its shadow.
    """
    sure = base.chi2_per_dof < NEAR and base.slow < STRAYS and judged.evidence > DOUBTFUL
    return sure and not at_bound(judged.fitted) and consistent(base, judged.fitted)


def whitened(base: Fitted, fit: Fitted) -> bool:
    """Whether most of what the errors have beyond white noise, in the stream that has most, goes with the effect."""
    before, after = (excess(f) for f in (base, fit))
    most = int(np.argmax(before))
    if before[most] < COLOURED or after.max() > 0.5 * before[most]:
        return False
    return stands_out(gains_by_time(base, fit))


def excess(fitted: Fitted) -> FloatArray:
    """Variance of the errors at low frequency over that of their white part, less one (3,): all streams but positions.

    Positions of a receiver wander by themselves, and what drifts would take that for its own.
    """
    dispersed = calibrated(fitted.problem, fitted.solution).dispersed
    return np.asarray(np.delete(dispersed.inflation, kernel.POSITION) ** 2 - 1.0, dtype=float)


def at_bound(fitted: Fitted, index: int | None = None) -> bool:
    """Whether a parameter of an effect, of the last one by default, ended at a bound; a coefficient may be nothing.

    That one taken before is driven to its bound, because it had stood for this one, does not speak against this one.
    """
    index = len(fitted.solution.structure.actives) - 1 if index is None else index
    return any(
        s.effect == index >= 0 and p in s.parameter.bounds and (p != s.parameter.null or s.coefficient < 0)
        for s, p in zip(fitted.solution.structure.slots, fitted.solution.p, strict=True)
    )


def plainest(worth: Sequence[Judged]) -> Judged | None:
    """What is worth taking most; of causes that are the same on these logs the plainer one.

    An input that never changes its sign has an offset where it might have a dead band, which acts no other way.
    """
    if not worth:
        return None
    least = worth[0].fitted.solution.total
    alike = [j for j in worth if abs(j.fitted.solution.total - least) < THE_SAME]
    return min(alike, key=lambda j: not smooth(j.screened.active))
