"""In which unseen logs an effect on some logs is there: each of them says so itself.

The logs of a fit tell that the vessel was heavier, or the water shallow, in some of them. Of a log that was held back
they cannot know it, and no prediction can be had without: which of the two it is, and no more, is read from that log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identify.effect import Active
from identify.effects.water_and_air import SHALLOW_WATER
from identify.fitted import Fitted
from identify.prepare import Prepared
from identify.stretch import Stretch
from validate.judgement import INDISTINCT
from validate.log_groups import in_logs
from validate.look_alikes import Standing
from validate.other_logs import on_other_logs
from validate.outcome import Outcome


def in_logs_as_they_say(outcome: Outcome, prepared: Prepared) -> Outcome:
    """The outcome with effects on some logs in those unseen logs as well that are clearly predicted better so."""
    fitted = outcome.fitted
    seen = {s.name for s in prepared.identify}
    names = sorted({s.name for s in prepared.validate} - seen)
    for index in range(len(fitted.solution.structure.actives)):
        for name in names:
            mine = [s for s in prepared.validate if s.name == name]
            fitted = _as_it_says(fitted, index, name, mine)
    if fitted is outcome.fitted:
        return outcome
    before, after = (f.solution.structure.actives for f in (outcome.fitted, fitted))
    new = {b.label: a for b, a in zip(before, after, strict=True)}
    return replace(outcome, fitted=fitted, standing=tuple(_renamed(s, new) for s in outcome.standing))


def _renamed(standing: Standing, new: dict[str, Active]) -> Standing:
    return replace(standing, active=new[standing.active.label])


def _as_it_says(fitted: Fitted, index: int, name: str, stretches: Sequence[Stretch]) -> Fitted:
    """The fit with one unseen log among those of an effect or not, whichever predicts it clearly better."""
    active = fitted.solution.structure.actives[index]
    logs = active.variant.options.get("logs")
    if not isinstance(logs, tuple) or (active.effect is SHALLOW_WATER and _depth_known(fitted, name)):
        return fitted
    other = in_logs(fitted, index, {name} ^ set(logs))
    here, there = (on_other_logs(f, stretches) for f in (fitted, other))
    if there is None:
        return fitted
    better = here is None or there.solution.cost < here.solution.cost - INDISTINCT
    return other if better else fitted


def _depth_known(fitted: Fitted, name: str) -> bool:
    """Whether a log's depth was declared, and those of the logs tell them apart."""
    setting = fitted.solution.structure.setting
    return setting.depths_tell and any(
        n == name and d is not None for n, d in zip(setting.logs, setting.depths, strict=False)
    )
