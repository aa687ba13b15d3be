"""The search of a model that another grew to, begun with what that was found to lack beside its terms."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from identify.base_fit import fit_from_scratch, tried
from identify.prepare import Prepared
from identify.structure import effects_alone
from identify.wander import drifts_shown, with_drifts
from validate.loop import searched_on
from validate.outcome import Outcome
from validate.pace import Pace
from validate.rounds import Turn
from validate.swell import in_swell
from validate.within import ALL


def grown(prepared: Prepared, found: Outcome, pace: Pace) -> Outcome | None:
    """The search of a richer model that goes on from the effects that a simpler one was ``found`` to lack.

    None where there are none, or these do not bring the richer one to the noise: then it is to be searched as any.
    """
    problem, old = found.fitted.problem, found.fitted.solution
    beside = tuple(a for a in old.structure.actives if a.effect.parameters)
    if found.wiring or not beside:
        return None
    structure = replace(prepared.structure, actives=beside)
    p = effects_alone(structure, structure.carried(old.p, old.structure))
    stretches = with_drifts(in_swell(prepared.identify, problem.swell), drifts_shown(problem))
    fitted = tried(partial(fit_from_scratch, structure, stretches, p, length=problem.length))
    if fitted is None or fitted.is_off:
        return None
    turns = tuple(t for t in found.turns if _took_one_beside(t))
    return searched_on(replace(found, fitted=fitted, turns=turns), ALL, pace)


def _took_one_beside(turn: Turn) -> bool:
    """Whether a round took an effect that is more than terms of the model."""
    return turn.taken is not None and bool(turn.taken.screened.active.effect.parameters)
