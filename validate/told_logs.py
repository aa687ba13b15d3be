"""In which logs a vessel is said to have been loaded otherwise: a group of logs and its complement say the same.

"1.75 times as heavy in these" is "0.57 times in the others": a person calls the heavier the odd ones, since what was
taken aboard is what one looks for, unless the others are far fewer.
"""

from __future__ import annotations

from dataclasses import replace

from identify.effect import Active
from identify.effects.sensors import MASS_CHANGE, loading_of
from identify.fitted import Fitted
from identify.noise import dispersed_cost
from validate.judgement import INDISTINCT
from validate.log_groups import free_in_logs, in_logs
from validate.look_alikes import Standing
from validate.outcome import Outcome
from validate.refits import under

#: Logs that are no more than one in so many of the others are the odd ones, whichever are heavier.
FAR_FEWER = 3


def told_of_the_odd_logs(outcome: Outcome) -> Outcome:
    """The outcome with every change of loading told of the odd logs, where it fits as well so."""
    fitted = outcome.fitted
    for index, active in enumerate(fitted.solution.structure.actives):
        if active.effect is MASS_CHANGE and free_in_logs(active, fitted.solution.structure):
            fitted = _told(fitted, index)
    if fitted is outcome.fitted:
        return outcome
    before, after = (f.solution.structure.actives for f in (outcome.fitted, fitted))
    new = {b.label: a for b, a in zip(before, after, strict=True)}
    known = {s.name for s in fitted.problem.stretches}
    standing = tuple(_renamed(s, new.get(s.active.label, s.active), known) for s in outcome.standing)
    return replace(outcome, fitted=fitted, standing=standing)


def _renamed(standing: Standing, active: Active, known: set[str]) -> Standing:
    """What stands under its new name, which is none of its own look-alikes: in the logs of the fit they are one."""
    if active is standing.active:
        return standing
    seen = tuple(n for n in _option(active) if n in known)
    variant = replace(active.variant, options={**active.variant.options, "logs": seen})
    own = {active.label, replace(active, variant=variant).label}
    others = tuple(a for a in standing.look_alikes if a not in own)
    return replace(standing, active=active, look_alikes=others)


def _told(fitted: Fitted, index: int) -> Fitted:
    structure = fitted.solution.structure
    logs, named = set(structure.setting.logs), set(_option(structure.actives[index]))
    known = {s.name for s in fitted.problem.stretches}
    ratio = structure.values(fitted.solution.p, index)["ratio"]
    odd, even = len(known & named), len(known - named)
    if _tells(odd, even, ratio):
        return fitted
    other = _of_the_others(fitted, index, logs - named, ratio)
    here, there = (dispersed_cost(f.problem, f.solution) - f.solution.penalty for f in (fitted, other))
    return other if there < here + INDISTINCT else fitted


def _tells(named: int, others: int, ratio: float) -> bool:
    """Whether a ratio is told of so many logs, and not of so many others."""
    if FAR_FEWER * min(named, others) <= max(named, others):
        return named < others or not others
    return ratio >= 1.0


def _option(active: Active) -> tuple[str, ...]:
    logs = active.variant.options["logs"]
    return logs if isinstance(logs, tuple) else ()


def _of_the_others(fitted: Fitted, index: int, logs: set[str], ratio: float) -> Fitted:
    """The same vessel with coefficients as they are in the logs that were named so far."""
    there = in_logs(fitted, index, logs)
    structure, p = there.solution.structure, fitted.solution.p.copy()
    active, layout = structure.actives[index], structure.layout
    by = loading_of({"ratio": ratio}, active.variant.options)
    p[structure.simple] *= layout.factors(by)[layout.plain]
    (own,) = (k for k, s in enumerate(structure.slots) if s.effect == index)
    p[own] = 1.0 / ratio
    begun = replace(there, solution=replace(there.solution, p=p))
    return under(fitted.problem, begun)
