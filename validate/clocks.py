"""Clocks that are off against each other: which of them it is, only the fewest say.

That every stream but one is early by as much is that the one is late.
"""

from __future__ import annotations

import numpy as np

from identify.base_fit import fit_from_scratch
from identify.effect import Active
from identify.fitted import Fitted
from identify.noise import dispersed_cost
from identify.structure import Structure, effects_alone
from validate.candidates import candidates
from validate.look_alikes import margin_for
from validate.refits import under

NAME = "clock_offset"


def fewer_clocks(fitted: Fitted) -> Fitted | None:
    """The fit with the other clocks off the other way, where these are fewer and nothing speaks for the many; or None.

    The time that they are all off by together is nothing that a log could show.
    """
    structure = fitted.solution.structure
    many = _clocks(structure.actives)
    bare = structure
    for active in many:
        bare = bare.without([a.label for a in bare.actives].index(active.label))
    few = [a for a in _clocks(candidates(bare)) if a.label not in {m.label for m in many}]
    if not few or len(few) >= len(many):
        return None
    off = np.median([structure.values(fitted.solution.p, structure.actives.index(a))["offset"] for a in many])
    simpler = bare
    for active in few:
        simpler = simpler.with_effect(active)
    found = under(fitted.problem, _begun_off(fitted, bare, simpler, -float(off)), 20)
    margin = margin_for(len(fitted.solution.p) - len(found.solution.p), fitted.problem.rows)
    enough = dispersed_cost(fitted.problem, fitted.solution) + margin
    return found if dispersed_cost(fitted.problem, found.solution) < enough else None


def _begun_off(fitted: Fitted, bare: Structure, simpler: Structure, offset: float) -> Fitted:
    """The fit with other clocks, each begun at an offset, s."""
    p = simpler.carried(bare.carried(fitted.solution.p, fitted.solution.structure), bare)
    added = range(len(bare.actives), len(simpler.actives))
    p = np.where([s.effect in added and s.name == "offset" for s in simpler.slots], offset, p)
    problem = fitted.problem
    return fit_from_scratch(
        simpler, problem.stretches, effects_alone(simpler, p), length=problem.length, rounds=0
    )


def _clocks(actives: tuple[Active, ...] | list[Active]) -> list[Active]:
    return [a for a in actives if a.effect.name == NAME]
