"""What came near an effect in the round that took it: it may stand in its place, whatever its signature says by then.

A coefficient that the logs say nothing of may be nothing beside the effect that was taken, and what acts by it then has
no signature: a weaker thruster has no moment where the moment of thrust is nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.fitted import Fitted
from validate.candidates import Screened
from validate.judgement import Judged
from validate.look_alikes import close_to
from validate.rounds import Turn


def runners_up(turns: Sequence[Turn], fitted: Fitted, index: int) -> list[Screened]:
    """What came near one of a fit's effects when that was taken, each with a start in its place.

    Far from the noise nothing is said of what came near.
    """
    label = fitted.solution.structure.actives[index].label
    return [
        _in_its_place(fitted, index, other)
        for turn in turns
        if turn.taken and turn.taken.label == label and not turn.base.is_far
        for other in turn.judged
        if other.label != label and turn.taken.gain - other.gain < close_to(turn.taken.gain)
    ]


def _in_its_place(fitted: Fitted, index: int, other: Judged) -> Screened:
    """The other cause in an effect's place, with the coefficients that it had, and the other effects' values as now."""
    now, active = fitted.solution, other.screened.active
    target = now.structure.without(index).with_effect(active)
    had = {key: v for key, v in _values(other.fitted).items() if key[0] in ("", active.label)}
    values = _values(fitted) | had
    nulls = target.carried(now.p, now.structure)
    start = np.array([values.get(target.key(s), null) for s, null in zip(target.slots, nulls, strict=True)])
    return Screened(active, start, start, 0.0)


def _values(fitted: Fitted) -> dict[tuple[str, str], float]:
    """Values of a fit's parameters by their keys."""
    structure, p = fitted.solution.structure, fitted.solution.p
    return {structure.key(s): float(v) for s, v in zip(structure.slots, p, strict=True)}
