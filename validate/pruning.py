"""Effects that were taken early and no longer stand once the others are in."""

from __future__ import annotations

from itertools import combinations

from identify.base_fit import fit_from_scratch
from identify.fitted import Fitted
from identify.noise import dispersed_cost
from identify.structure import effects_alone
from validate.candidates import candidates
from validate.judgement import DOUBTFUL, least_gain, parameters_of
from validate.log_groups import free_in_logs, in_logs, logs_of
from validate.look_alikes import dropped, losses_without, refitted_as
from validate.pace import Pace
from validate.refits import under
from validate.scan import best_value
from validate.score_scatter import scatter
from validate.within import GivenUp


def pruned(fitted: Fitted, pace: Pace) -> Fitted:
    """Drop effects that no longer stand once the others are in, the weakest first; of two that are one, make one."""
    while (one := _two_as_one(fitted)) is not None:
        pace("two that are one")
        fitted = one
    while doubted := searched(fitted):
        pace.expect(2.0 * len(doubted))
        pace("what was taken, again")
        losses = losses_without(fitted, doubted)
        weakest = min(losses, key=lambda k: losses[k])
        without = _as_good_without(fitted, weakest, losses[weakest])
        if without is None:
            return fitted
        pace(f"dropped: {fitted.solution.structure.actives[weakest].label}")
        fitted = without
    return fitted


def fewer(fitted: Fitted, pace: Pace, cut: bool) -> Fitted:
    """A fit without effects that no longer stand.

    Raises
    ------
    GivenUp
        Where all of them stand, or it was ``cut`` so before.
    """
    found = fitted if cut else pruned(fitted, pace)
    if found is fitted:
        raise GivenUp
    return found


def _as_good_without(fitted: Fitted, index: int, loss: float) -> Fitted | None:
    """A fit without an effect that loses no more by it than chance gives; None where there is none.

    An effect of little weight may only make up for another that ended in a wrong valley: then the others are begun
    anew without it.
    """
    structure = fitted.solution.structure
    without = structure.without(index)
    k = parameters_of(structure, index)
    others, by_chance = len(candidates(without)), scatter(fitted, index)
    if loss < by_chance.ratio * least_gain(k, others, by_chance.degrees):
        return dropped(fitted, index)
    if loss > DOUBTFUL or not without.actives:
        return None
    other = _begun_anew(fitted, index)
    lost = dispersed_cost(fitted.problem, other.solution) - dispersed_cost(fitted.problem, fitted.solution)
    return other if lost < least_gain(k, others) else None


def _two_as_one(fitted: Fitted) -> Fitted | None:
    """A fit in which one change in some logs does as well as two of a kind; None where there is none.

    A load that was there in two of five logs may be found as less in a third first, and then as more in all three.
    """
    structure = fitted.solution.structure
    free = [k for k, a in enumerate(structure.actives) if free_in_logs(a, structure)]
    names = {s.name for s in fitted.problem.stretches}
    for one, other in combinations(free, 2):
        if structure.actives[one].effect is not structure.actives[other].effect:
            continue
        here, there = (set(logs_of(structure.actives[k])) for k in (one, other))
        for logs in (here ^ there, here | there, here & there):
            if 0 < len(logs & names) < len(names) and (found := _in_these(fitted, one, other, logs)):
                return found
    return None


def _in_these(fitted: Fitted, one: int, other: int, logs: set[str]) -> Fitted | None:
    """A fit without one effect and with the other in these logs; None where it loses more than chance gives."""
    moved = in_logs(fitted, other, logs)
    without = moved.solution.structure.without(one)
    found = refitted_as(moved, without)
    lost = dispersed_cost(fitted.problem, found.solution) - dispersed_cost(fitted.problem, fitted.solution)
    k = parameters_of(fitted.solution.structure, one)
    return found if lost < least_gain(k, len(candidates(without))) else None


def _begun_anew(fitted: Fitted, index: int) -> Fitted:
    """The fit without an effect, the others begun where the accelerations want them."""
    structure, stretches = fitted.solution.structure.without(index), fitted.problem.stretches
    p = structure.carried(fitted.solution.p, fitted.solution.structure)
    for k in range(len(structure.actives)):
        wanted = best_value(structure, stretches, p, k)
        p = p if wanted is None else wanted
    found = fit_from_scratch(structure, stretches, effects_alone(structure, p), length=fitted.problem.length)
    return under(fitted.problem, found, 20)


def searched(fitted: Fitted) -> list[int]:
    """Places of the effects that were found by their likelihood (the wiring was not)."""
    return [k for k, a in enumerate(fitted.solution.structure.actives) if not a.effect.rewire]
