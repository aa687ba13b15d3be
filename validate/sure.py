"""Whether what was taken is sure once everything that moves a vessel without being logged counts.

The search weighs errors by their size and their slow part. What pushes a vessel, or lets its position drift, adds up
over a log, and an effect that drifts with it (a current of a millimetre per second, a roll of no size) may seem certain
by thousands of samples that all say the same. The standard errors that are reported know better. And no model is true
to the last digit: what hardly changes a free run may stand for its own small faults, and must be beyond doubt.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identify.acting import input_clocks
from identify.base_fit import CLEARLY
from identify.disturbance import deviance, with_disturbances
from identify.first_states import first_states
from identify.fitted import Fitted
from identify.free_running import free_running_errors
from identify.output_error import Prior, information_of, solve
from identify.parameter_covariance import covariance_of
from identify.structure import null_parameters
from identify.whole_windows import over_whole_logs
from preprocess.cores import side_by_side
from validate.as_one import as_one, same_elsewhere
from validate.candidates import candidates
from validate.judgement import DOUBTFUL, at_bound, least_gain, parameters_of
from validate.log_groups import free_in_logs
from validate.look_alikes import departure, dropped, left_on
from validate.loop import searched_on
from validate.nearer import leaves_much
from validate.outcome import Outcome, all_standing
from validate.pace import Pace
from validate.pruning import searched
from validate.refits import step_tolerance
from validate.rounding import done_by_rounding
from validate.slight_clocks import slight_clocks, with_slight_clocks_known
from validate.within import BELIEVABLE, NONE, First, GivenUp, Names, Within

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: An effect without which no channel of free runs is worse by this share needs evidence beyond doubt.
MATERIAL = 0.1
#: ... or those that are by less than this, as a root mean square of u, v and r in units of their spread.
LITTLE = 0.02
#: So many times a search goes on without what was taken back.
SEARCHES = 2
#: Places of effects that move nothing: free runs need not be worse without them.
SHOWN_ONLY = ("sensor", "clock")
#: An input is late where it acts so many standard errors after it is written.
SURELY = 3.0
#: Evidence that needs no second look.
OVERWHELMING = 1000.0


def surely(outcome: Outcome) -> Outcome:
    """The outcome without effects that their own standard errors do not tell from nothing, the least sure first.

    What was taken back kept others from being looked at. Where its place is left empty by what matters, the search goes
    on without it, and what it finds must be sure as well.
    """
    pace, taken_back = Pace(), NONE
    sure = _without_unsure(outcome, pace)
    for _ in range(SEARCHES):
        if sure is outcome or not leaves_much(sure.fitted):
            return sure
        taken_back |= _names(outcome.fitted) - _names(sure.fitted)
        try:
            outcome = searched_on(sure, Within(taken_back, first=_held_against(outcome.fitted)), pace)
        except GivenUp:
            return sure
        sure = _without_unsure(outcome, pace)
    return sure


def _held_against(fitted: Fitted) -> First:
    """What a search that goes on must come clearly nearer than: with a few effects one that stayed off the noise.

    What stands in the place of something that nothing known is can be exchanged for others as vain, without end. One
    that came to the noise with effects that were not sure needs no more of them in their place; how far off it is
    without any says nothing.
    """
    had = len(fitted.solution.structure.actives)
    if not fitted.is_off:
        return First(fitted.chi2_per_dof, had + 1, at_noise=True, hopeless=np.inf)
    return First(CLEARLY**2 * fitted.chi2_per_dof, max(BELIEVABLE, had))


def _names(fitted: Fitted) -> Names:
    return frozenset(a.effect.name for a in fitted.solution.structure.actives)


def _without_unsure(outcome: Outcome, pace: Pace) -> Outcome:
    fitted, unsure = with_slight_clocks_known(outcome.fitted), list(outcome.unsure)
    slight = [outcome.fitted.solution.structure.actives[k].label for k in slight_clocks(outcome.fitted)]
    while (least := _least_sure(fitted)) is not None:
        unsure.append(fitted.solution.structure.actives[least].label)
        fitted = dropped(fitted, least)
    if fitted is outcome.fitted:
        return outcome
    standing = all_standing(fitted, outcome.wiring, pace, outcome.turns)
    slight = [*outcome.slight, *slight]
    return replace(outcome, fitted=fitted, standing=standing, unsure=tuple(unsure), slight=tuple(slight))


def _least_sure(fitted: Fitted) -> int | None:
    """Which effect says least more than it needs to say; None where all say more, by themselves or on all inputs."""
    doubted = searched(fitted)
    if not doubted:
        return None
    found = with_disturbances(over_whole_logs(fitted))
    covariance = covariance_of(found)
    said = side_by_side(partial(_beyond, found, covariance), doubted)
    beyond = dict(zip(doubted, said, strict=True))
    unsure = sorted((k for k in doubted if beyond[k] < 0.0), key=lambda k: beyond[k])
    return next((k for k in unsure if not _sure_as_one(fitted, same_elsewhere(fitted, k, unsure))), None)


def _sure_as_one(fitted: Fitted, same: Sequence[int]) -> bool:
    """Whether an effect that is on several inputs, and unsure on each, is sure on all of them alike."""
    if len(same) < 2:
        return False
    one = with_disturbances(over_whole_logs(as_one(fitted, same)))
    return _beyond(one, covariance_of(one), len(one.solution.structure.actives) - 1) >= 0.0


def _beyond(fitted: Fitted, covariance: FloatArray, index: int) -> float:
    """How much more evidence there is for an effect than chance gives, or than one needs that moves next to nothing.

    A value that could go no further is none; nor is a delay that the input's log may hide.
    """
    if at_bound(fitted, index) or _between_entries(fitted, covariance, index):
        return -np.inf
    without = dropped(fitted, index)
    said, needed = evidence(fitted, without, covariance, index), _by_chance(fitted, index)
    if needed < said < DOUBTFUL and _immaterial(fitted, without):
        needed = DOUBTFUL
    if needed < said < OVERWHELMING and _may_be_rounding(fitted, without, index):
        needed = OVERWHELMING
    return said - needed


def _may_be_rounding(fitted: Fitted, without: Fitted, index: int) -> bool:
    """Whether free runs are worse without what moves the vessel by no more than the rounding of its inputs does.

    Channels that are no worse are not asked: in one that a log hardly moves, free runs are off by chance.
    """
    if fitted.solution.structure.actives[index].effect.place in SHOWN_ONLY:
        return False
    here, there = (free_running_errors(f) for f in (fitted, without))
    return bool(np.maximum(there - here, 0.0).sum() < without.remembered(done_by_rounding))


def _between_entries(fitted: Fitted, covariance: FloatArray, index: int) -> bool:
    """Whether an input that is late is not surely so by its own log: it may act as written, having begun before.

    An order that steps and a rudder that moves between the same entries are ahead of them by parts of an interval that
    differ, and the one that is less so seems to be late. A lag is late by its time constant.
    """
    structure, p = fitted.solution.structure, fitted.solution.p
    active, stretch = structure.actives[index], fitted.problem.stretches[0]
    times = [q.name for q in active.effect.parameters if q.unit == "s"]
    if active.variant.input is None or not times:
        return False
    acts = input_clocks(structure, p, stretch)[active.variant.input]
    if active.effect.input_delay is None:
        acts -= sum(structure.values(p, index)[name] for name in times)
    mine = [k for k, s in enumerate(structure.slots) if s.effect == index and s.parameter.name in times]
    error = float(np.sqrt(covariance[np.ix_(mine, mine)].sum()))
    return bool(acts >= stretch.start - SURELY * error)


def _immaterial(fitted: Fitted, without: Fitted) -> bool:
    """Whether free runs of the logs are hardly worse without an effect: what models leave out may look like it.

    What turns a vessel shows in its yaw rate, however little is known of its speed.
    """
    here, there = (free_running_errors(f) for f in (fitted, without))
    worse = there >= (1.0 + MATERIAL) ** 2 * here
    return float((there - here)[worse].sum()) < LITTLE**2


def _by_chance(fitted: Fitted, index: int) -> float:
    """What chance alone gives an effect: the best of all that were looked at, and of all choices of its logs."""
    structure = fitted.solution.structure
    tried = len(candidates(structure.without(index)))
    if free_in_logs(structure.actives[index], structure):
        tried += 2 ** len({s.name for s in fitted.problem.stretches}) - 2
    return least_gain(parameters_of(structure, index), tried)


def evidence(fitted: Fitted, without: Fitted, covariance: FloatArray, index: int) -> float:
    """What dropping an effect costs, in units in which chance gives χ² of as many degrees as it has parameters.

    Where that leaves doubt, pushes must not do as well, each model with those that are likeliest with it, and the
    effect's sizes must not be within their errors of nothing; far more than pushes can do is no doubt. A wind without
    any is none, though: what it stands for is a resistance, and it must do better than that by as much. Nor is a
    shallow water in which the hull's coefficients are no larger.
    """
    mine, _ = departure(fitted, index)
    said = _by_cost(fitted, without, covariance, mine)
    if said < OVERWHELMING and np.isfinite(here := deviance(fitted)):
        pushed = deviance(without) - here
        said = pushed if pushed > OVERWHELMING else min(said, pushed, _by_size(fitted, covariance, index))
    flow = _flow_of(fitted, mine)
    return min(said, _by_flow(fitted, covariance, flow)) if len(flow) else said


def _by_cost(fitted: Fitted, without: Fitted, covariance: FloatArray, mine: IntArray) -> float:
    """Likelihood ratio of a fit to one without some parameters, over Rao and Scott's factor.

    The cost weighs errors by their size alone; by as much as the covariance exceeds what that makes of it, in the mean
    over the parameters, chance costs more (Rao and Scott 1984). Unlike Wald's statistic it does not depend on how an
    effect is written: of a wind's speed and of its coefficients neither may be known where their product is.
    """
    information = information_of(fitted.solution, fitted.prior)
    alone = left_on(information, np.setdiff1d(np.arange(len(information)), mine), mine)
    factor = max(1.0, float(np.trace(alone @ covariance[np.ix_(mine, mine)])) / len(mine))
    return (without.solution.total - fitted.solution.total) / factor


def _by_size(fitted: Fitted, covariance: FloatArray, index: int) -> float:
    """Wald's statistic of the parameters that say how much of an effect there is, not of what shape."""
    mine, away = departure(fitted, index)
    sizes = np.array([not fitted.solution.structure.slots[k].parameter.shape for k in mine])
    return _wald(covariance, mine[sizes], away[sizes])


def _flow_of(fitted: Fitted, mine: IntArray) -> IntArray:
    """Parameters of the flow, or the factor, that an effect is made by where it has coefficients as well; else none."""
    linear = np.array([fitted.solution.structure.slots[k].coefficient >= 0 for k in mine])
    return mine[~linear] if linear.any() else mine[:0]


def _by_flow(fitted: Fitted, covariance: FloatArray, flow: IntArray) -> float:
    """What it costs that an effect's flow stands still, or its factor is one, its coefficients free.

    Against the likeliest pushes, too.
    """
    still = _standing_still(fitted, flow)
    said = _by_cost(fitted, still, covariance, flow)
    if said < OVERWHELMING and np.isfinite(here := deviance(fitted)):
        away = fitted.solution.p[flow] - _nothing(fitted, flow)
        return max(min(said, deviance(still) - here), _wald(covariance, flow, away))
    return said


def _standing_still(fitted: Fitted, flow: IntArray) -> Fitted:
    """The fit with an effect's flow held at nothing."""
    problem, solution, prior = fitted.problem, fitted.solution, fitted.prior
    p, mean, sd = solution.p.copy(), prior.mean.copy(), prior.sd.copy()
    p[flow] = mean[flow] = _nothing(fitted, flow)
    sd[flow] = 1e-9
    held = Prior(mean, sd)
    found = solve(
        problem, solution.structure, p, solution.first, held, anchor=first_states(problem), budget=20,
        tolerance=step_tolerance(fitted),
    )  # fmt: skip
    return Fitted(problem, held, found)


def _nothing(fitted: Fitted, where: IntArray) -> FloatArray:
    """What parameters are where there is nothing of their effect: no flow, a factor of one."""
    return null_parameters(fitted.solution.structure)[where]


def _wald(covariance: FloatArray, where: IntArray, off: FloatArray) -> float:
    """Square of a departure in units of its errors; directions that nothing tells count for nothing."""
    told = np.diag(covariance)[where] > 1e-200
    where, off = where[told], off[told]
    mine = covariance[np.ix_(where, where)]
    scale = np.sqrt(np.diag(mine))
    return float(off / scale @ np.linalg.pinv(mine / scale / scale[:, None], rcond=1e-12) @ (off / scale))
