"""Clocks that are off against each other: which of them it is, only the fewest say.

That every stream but one is early by as much is that the one is late.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identify.base_fit import fit_from_scratch, tried
from identify.effect import Active
from identify.fitted import Fitted
from identify.noise import calibrated, dispersed_cost
from identify.structure import Structure, effects_alone
from identify.taken_order import in_order_taken, ordered_by
from identify.windows import Problem
from validate.candidates import candidates
from validate.look_alikes import margin_for
from validate.refits import under

NAME = "clock_offset"
#: Steps of a refit.
FOLLOWED = 20


def fewer_clocks(fitted: Fitted) -> Fitted | None:
    """The fit with the other clocks off the other way, where these are fewer and nothing speaks for the many; or None.

    The time that they are all off by together is nothing that a log could show.
    """
    structure = fitted.solution.structure
    many = [k for k, a in enumerate(structure.actives) if a.effect.name == NAME]
    bare = replace(structure, actives=tuple(a for k, a in enumerate(structure.actives) if k not in many))
    had = {structure.actives[k].label for k in many}
    few = [a for a in candidates(bare) if a.effect.name == NAME and a.label not in had]
    if not few or len(few) >= len(many):
        return None
    off = float(np.median([structure.values(fitted.solution.p, k)["offset"] for k in many]))
    found = tried(partial(_begun, fitted, bare, few, -off))
    if found is None:
        return None
    margin = margin_for(len(fitted.solution.p) - len(found.solution.p), fitted.problem.rows)
    weights = _weights(fitted)
    return found if _excess(found, weights) < _excess(fitted, weights) + margin else None


def _begun(fitted: Fitted, bare: Structure, few: Sequence[Active], offset: float) -> Fitted:
    """The fit with a few clocks in place of those that it has, each begun at an offset, s."""
    structure, problem = replace(bare, actives=(*bare.actives, *few)), fitted.problem
    p = structure.carried(fitted.solution.p, fitted.solution.structure)
    mine = [s.effect >= len(bare.actives) for s in structure.slots]
    p = effects_alone(structure, np.where(mine, offset, p))
    stretches = ordered_by(structure, p, problem).stretches
    return in_order_taken(fit_from_scratch(structure, stretches, p, length=problem.length, rounds=0))


def _weights(fitted: Fitted) -> Problem:
    """Weights of errors that know nothing of what the inputs hide: other clocks make another thing of that."""
    if fitted.problem.unlogged is None:
        return fitted.problem
    bare = replace(fitted.problem, unlogged=None)
    return calibrated(bare, under(bare, fitted, FOLLOWED).solution)


def _excess(fitted: Fitted, weights: Problem) -> float:
    """What a fit costs beyond one for each row, in the windows in which its own clocks say that samples were taken."""
    problem = ordered_by(fitted.solution.structure, fitted.solution.p, weights)
    return dispersed_cost(problem, under(problem, fitted, FOLLOWED).solution) - problem.rows
