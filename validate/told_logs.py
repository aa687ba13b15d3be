"""In which logs a vessel is said to have been loaded otherwise: a group of logs and its complement say the same.

"1.75 times as heavy in these" is "0.57 times in the others": a person calls those logs the odd ones that are fewer,
and of as many the heavier, since what was taken aboard is what one looks for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.effects.sensors import MASS_CHANGE
from identify.fitted import Fitted
from validate.judgement import INDISTINCT
from validate.log_groups import free_in_logs, in_logs
from validate.loop import Outcome
from validate.refits import under

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def told_of_the_odd_logs(outcome: Outcome) -> Outcome:
    """The outcome with every change of loading told of fewer logs, or the heavier ones, where it fits as well so."""
    fitted = outcome.fitted
    for index, active in enumerate(fitted.solution.structure.actives):
        if active.effect is MASS_CHANGE and free_in_logs(active, fitted.solution.structure):
            fitted = _told(fitted, index)
    if fitted is outcome.fitted:
        return outcome
    new = dict(zip(_labels(outcome.fitted), fitted.solution.structure.actives, strict=True))
    standing = tuple(replace(s, active=new.get(s.active.label, s.active)) for s in outcome.standing)
    return replace(outcome, fitted=fitted, standing=standing)


def _labels(fitted: Fitted) -> list[str]:
    return [a.label for a in fitted.solution.structure.actives]


def _told(fitted: Fitted, index: int) -> Fitted:
    structure = fitted.solution.structure
    logs, named = set(structure.setting.logs), structure.actives[index].variant.options["logs"]
    ratio = structure.values(fitted.solution.p, index)["ratio"]
    here, others = len(logs & set(named)), len(logs - set(named))  # type: ignore[call-overload]
    if not others or here < others or (here == others and ratio >= 1.0):
        return fitted
    other = _of_the_others(fitted, index, logs - set(named), ratio)  # type: ignore[call-overload]
    return other if other.solution.cost < fitted.solution.cost + INDISTINCT else fitted


def _of_the_others(fitted: Fitted, index: int, logs: set[str], ratio: float) -> Fitted:
    """The same vessel with coefficients as they are in the logs that were named so far."""
    there = in_logs(fitted, index, logs)
    structure, p = there.solution.structure, fitted.solution.p.copy()
    active = structure.actives[index]
    if active.effect.loading is not None:
        by = active.effect.loading({"ratio": ratio}, active.variant.options)
        layout = structure.layout
        factor = np.where(layout.inertial, by.inertial, np.where(layout.vessel, by.others, 1.0))
        p[structure.simple] *= factor[layout.plain]
    (own,) = (k for k, s in enumerate(structure.slots) if s.effect == index)
    p[own] = 1.0 / ratio
    begun = replace(there, solution=replace(there.solution, p=p))
    return under(fitted.problem, begun)
