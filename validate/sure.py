"""Whether what was taken is sure once everything that moves a vessel without being logged counts.

The search weighs errors by their size and their slow part. What pushes a vessel, or lets its position drift, adds up
over a log, and an effect that drifts with it (a current of a millimetre per second, a roll of no size) may seem certain
by thousands of samples that all say the same. The standard errors that are reported know better.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.base_fit import Fitted, over_whole_logs
from identify.disturbance import with_disturbances
from identify.report_fit import covariance_of
from validate.candidates import candidates
from validate.judgement import least_gain
from validate.look_alikes import departure, dropped, loss_without
from validate.loop import DOUBTFUL, Outcome, all_standing, searched
from validate.pace import Pace

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def surely(outcome: Outcome) -> Outcome:
    """The outcome without effects that their own standard errors do not tell from nothing, the least sure first."""
    fitted, unsure = outcome.fitted, list(outcome.unsure)
    while (least := _least_sure(fitted)) is not None:
        unsure.append(fitted.solution.structure.actives[least].label)
        fitted = dropped(fitted, least)
    if fitted is outcome.fitted:
        return outcome
    standing = all_standing(fitted, outcome.wiring, Pace())
    return replace(outcome, fitted=fitted, standing=standing, unsure=tuple(unsure))


def _least_sure(fitted: Fitted) -> int | None:
    """Which effect says least more than chance alone says; None where all say more, or would be missed."""
    found = with_disturbances(over_whole_logs(fitted)) if searched(fitted) else fitted
    if found.disturbed is None:
        return None
    covariance = covariance_of(found)
    beyond = {k: evidence(found, covariance, k) - _by_chance(fitted, k) for k in searched(fitted)}
    doubted = sorted((k for k in beyond if beyond[k] < 0.0), key=lambda k: beyond[k])
    return next((k for k in doubted if loss_without(fitted, k) <= DOUBTFUL), None)


def _by_chance(fitted: Fitted, index: int) -> float:
    """What chance alone gives an effect; what it was searched over in shape counts, as it may follow the noise."""
    structure = fitted.solution.structure
    without = structure.without(index)
    return least_gain(len(structure.slots) - len(without.slots), len(candidates(without)))


def evidence(fitted: Fitted, covariance: FloatArray, index: int) -> float:
    """Wald's statistic of an effect against nothing, of what says how much it acts.

    How fast a roll swings says nothing where it moves nothing.
    """
    mine, away = departure(fitted, index)
    much = np.array([not fitted.solution.structure.slots[k].parameter.shape for k in mine])
    mine, away = mine[much], away[much]
    return float(away @ np.linalg.pinv(covariance[np.ix_(mine, mine)]) @ away)
