"""What was found on several inputs alike, as an effect on each of them: from there on each has its own value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.effect import Active
from identify.fitted import Fitted
from validate.candidates import prior_of
from validate.refits import under


def on_each_input(fitted: Fitted) -> Fitted:
    """The fit with every effect that is on several inputs as one on each, begun with the value that they had alike."""
    s, structure = fitted.solution, fitted.solution.structure
    parts = [
        (k, Active(a.effect, variant, a.begin))
        for k, a in enumerate(structure.actives)
        for variant in a.variant.each
    ]
    if len(parts) == len(structure.actives):
        return fitted
    apart = replace(structure, actives=tuple(a for _, a in parts))
    had = {(slot.effect, slot.name): v for slot, v in zip(structure.slots, s.p, strict=True)}
    p = np.array([had[parts[t.effect][0] if t.effect >= 0 else -1, t.name] for t in apart.slots])
    begun = replace(fitted, prior=prior_of(apart, p, fitted), solution=replace(s, structure=apart, p=p))
    return under(fitted.problem, begun, 20)
