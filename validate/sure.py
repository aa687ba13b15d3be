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
from validate.loop import DOUBTFUL, Outcome

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def surely(outcome: Outcome) -> Outcome:
    """The outcome without effects that their own standard errors do not tell from nothing, the weakest first."""
    while (weakest := _unsure(outcome.fitted)) is not None:
        label = outcome.fitted.solution.structure.actives[weakest].label
        standing = tuple(s for s in outcome.standing if s.active.label != label)
        outcome = replace(outcome, fitted=dropped(outcome.fitted, weakest), standing=standing)
    return outcome


def _unsure(fitted: Fitted) -> int | None:
    """Which effect says the least against being nothing, where chance alone says as much; None where all are sure."""
    structure = fitted.solution.structure
    searched = [k for k, a in enumerate(structure.actives) if not a.effect.rewire]
    found = with_disturbances(over_whole_logs(fitted)) if searched else fitted
    if found.disturbed is None:
        return None
    covariance = covariance_of(found)
    said = {k: evidence(found, covariance, k) for k in searched}
    weakest = min(said, key=lambda k: said[k])
    without = structure.without(weakest)
    least = least_gain(len(structure.slots) - len(without.slots), len(candidates(without)))
    if said[weakest] > least or loss_without(fitted, weakest) > DOUBTFUL:
        return None
    return weakest


def evidence(fitted: Fitted, covariance: FloatArray, index: int) -> float:
    """Wald's statistic of an effect against nothing; of one with terms, that of their coefficients.

    How fast a roll swings says nothing where it moves nothing.
    """
    mine, away = departure(fitted, index)
    slots = fitted.solution.structure.slots
    linear = np.array([slots[k].coefficient >= 0 for k in mine])
    if linear.any():
        mine, away = mine[linear], away[linear]
    scale = np.sqrt(np.maximum(np.diag(covariance)[mine], 1e-300))
    correlation = covariance[np.ix_(mine, mine)] / np.outer(scale, scale)
    return float((away / scale) @ np.linalg.pinv(correlation, rcond=1e-9) @ (away / scale))
