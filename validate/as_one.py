"""The same effect on several inputs taken for one on all of them alike.

Inputs that are moved alike tell what is wrong with all of them, and not of how much with each: of two rudders on one
wheel neither may surely be slow where both surely are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.effect import Active
from identify.fitted import Fitted
from validate.candidates import prior_of
from validate.refits import under


def same_elsewhere(fitted: Fitted, index: int, some: Sequence[int]) -> list[int]:
    """Which of some effects are the same as one, that effect itself with them, on inputs of their own."""
    actives = fitted.solution.structure.actives
    mine = actives[index]
    if mine.variant.input is None:
        return []
    return [
        k
        for k in some
        if (actives[k].effect.name, actives[k].variant.options) == (mine.effect.name, mine.variant.options)
    ]


def as_one(fitted: Fitted, indices: Sequence[int]) -> Fitted:
    """The fit with effects that are the same on several inputs as one on all, its last, begun with the mean values."""
    s, structure = fitted.solution, fitted.solution.structure
    first, *others = (structure.actives[k] for k in indices)
    inputs = tuple(n for a in others for n in a.variant.inputs)
    one = Active(first.effect, replace(first.variant, besides=(*first.variant.besides, *inputs)), first.begin)
    target = structure
    for k in sorted(indices, reverse=True):
        target = target.without(k)
    target = target.with_effect(one)
    each = [structure.values(s.p, k) for k in indices]
    mean = {name: float(np.mean([v[name] for v in each])) for name in each[0]}
    p, last = target.carried(s.p, structure), len(target.actives) - 1
    p = np.array([mean[t.name] if t.effect == last else v for t, v in zip(target.slots, p, strict=True)])
    begun = replace(fitted, prior=prior_of(target, p, fitted), solution=replace(s, structure=target, p=p))
    return under(fitted.problem, begun, 20)
