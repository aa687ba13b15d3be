"""What fits have in common with those they were begun from: need not be sent between processes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from identify.effects import EFFECTS

if TYPE_CHECKING:
    from identify.fitted import Fitted


def in_common(*fits: Fitted) -> list[object]:
    """The problems, stretches and structures of some fits, with all parts of these that a new one takes over."""
    found: list[object] = [*EFFECTS]
    for fitted in fits:
        s, problem = fitted.solution.structure, fitted.problem
        found += [problem, *problem.stretches, s, s.model, s.vessel, s.inputs, s.setting, *s.actives]
    return found
