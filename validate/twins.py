"""Inputs that move alike: what is wrong with one of them may be wrong with the other.

Two rudders on one wheel are logged apart, each with the rounding and the noise of its own log. A cause on one then fits
a little better than the same cause on the other by what these errors happen to be, and not by what the vessel did.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.effect import Active
from identify.fitted import Fitted
from identify.stretch import Stretch
from validate.candidates import Screened

#: Inputs move alike whose difference is less than this share of how much they move.
ALIKE = 0.03


def on_twins(fitted: Fitted, index: int, rivals: Sequence[Active]) -> list[Screened]:
    """Those of the rivals that are an effect of a fit on an input that moves like its own, with its values."""
    structure = fitted.solution.structure
    found = []
    for other in rivals:
        if not is_twin(structure.actives[index], other, fitted.problem.stretches):
            continue
        target = structure.without(index).with_effect(other)
        p, last = target.carried(fitted.solution.p, structure), len(target.actives) - 1
        values = structure.values(fitted.solution.p, index)
        mine = [
            values.get(s.name, v) if s.effect == last else v for s, v in zip(target.slots, p, strict=True)
        ]
        found.append(Screened(other, np.array(mine), np.array(mine), 0.0))
    return found


def is_twin(active: Active, other: Active, stretches: Sequence[Stretch]) -> bool:
    """Whether a cause is the same as another, on one input that moves like that of the other."""
    one, two = active.variant.inputs, other.variant.inputs
    if not len(one) == len(two) == 1 or one == two:
        return False
    same = other.effect is active.effect and replace(other.variant, input=one[0]) == active.variant
    return same and _move_alike(stretches, one[0], two[0])


def _move_alike(stretches: Sequence[Stretch], one: str, other: str) -> bool:
    """Whether two inputs do the same in all stretches, to what their logs can tell."""
    grids = [s.grid for s in stretches]
    first, second = (
        np.concatenate(
            [np.interp(t, s.inputs[n].t, s.inputs[n].value) for t, s in zip(grids, stretches, strict=True)]
        )
        for n in (one, other)
    )
    return bool(np.sqrt(np.mean((first - second) ** 2)) < ALIKE * np.std(first))
