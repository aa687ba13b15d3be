"""Two causes that show only together: what both promise, of every pair, and refits of those that promise most.

Where two are missing, each alone may bend everything to make up for the other, and a third cause look better than
either, or than both once it is in. A first order says of every pair what both gain with all else free to follow, in
place of an effect that was taken too, for the cost of one look at all causes; near the noise it can be believed so far
that the best of them are worth a refit.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from identify.effect import Active
from identify.first_states import first_states
from identify.fitted import FAR, Fitted
from identify.noise import dispersed_cost
from identify.output_error import solve
from validate.candidates import bend_alike, candidates, prior_of, screen_at
from validate.first_order import first_order
from validate.judgement import SETTLED, Judged, judged_under, least_gain, worthwhile
from validate.pace import Pace
from validate.refits import refit, step_tolerance
from validate.score_scatter import scatter
from validate.search_ends import total

#: So many pairs are refitted at most.
REFITTED = 2


class Promise(NamedTuple):
    """Two causes, the one that does more alone first, and what they promise together in 2 log likelihood."""

    causes: tuple[Active, Active]
    gain: float


def best_pair(
    base: Fitted, taken: Judged | None, actives: Sequence[Active], pace: Pace
) -> tuple[Judged, Judged] | None:
    """Two causes that together explain clearly more than what was taken, or than nothing; judged one after the other.

    Asked where the fit is near the noise and what was taken leaves it off; None where no pair does.
    """
    reached = taken.fitted if taken else base
    if not (base.chi2_per_dof < FAR and reached.is_off) or len(actives) < 2:
        return None
    every = promises(base, actives)
    least = base.solution.total - reached.solution.total + least_gain(2, len(every))
    for promise in sorted(every, key=lambda x: -x.gain)[:REFITTED]:
        if promise.gain < least:
            break
        pace(f"{promise.causes[0].label} with {promise.causes[1].label}")
        one, both = _refitted(base, promise, len(every))
        if both.evidence > 0.0 and _clearly_better(base, reached, both.fitted, len(every)):
            return one, both
    return None


def two_for_one(fitted: Fitted, barred: Collection[str] = ()) -> Fitted | None:
    """The fit with two causes in place of one that was taken, where the measurements clearly prefer them; or None.

    What was taken first, and alone, may have made up for two that are more than it. Effects whose names are ``barred``
    are not looked at.
    """
    structure = fitted.solution.structure
    actives = [a for a in candidates(structure) if a.effect.name not in barred]
    if not fitted.chi2_per_dof < FAR or len(actives) < 2:
        return None
    found = [
        there
        for k, active in enumerate(structure.actives)
        if not active.effect.rewire
        for there in _instead_of(fitted, k, promises(fitted, actives, k))
    ]
    return min(found, key=lambda f: total(f.solution), default=None)


def _instead_of(fitted: Fitted, index: int, every: Sequence[Promise]) -> list[Fitted]:
    """Fits with two causes in place of an effect that the measurements clearly prefer, of those that promise most."""
    likely = [x for x in every if x.gain > least_gain(2, len(every))]
    best = sorted(likely, key=lambda x: -x.gain)[:REFITTED]
    refitted = [_in_place_of(fitted, index, promise) for promise in best]
    return [f for f in refitted if _preferred(fitted, f, len(every))]


def promises(base: Fitted, actives: Sequence[Active], without: int | None = None) -> list[Promise]:
    """What every two causes promise together from where all do nothing; in place of an effect if one is left out."""
    actives = _beside_all(base, actives)
    known, places = first_order(base, actives, without)
    alone = {k: known.gain(mine) for k, mine in places.items()}
    found = []
    for pair in combinations(places, 2):
        a, b = sorted(pair, key=lambda k: -alone[k])
        if bend_alike(actives[a], actives[b]):
            continue
        gain = known.gain(np.concatenate([places[a], places[b]])) - known.loss
        found.append(Promise((actives[a], actives[b]), gain))
    return found


def _beside_all(base: Fitted, actives: Sequence[Active]) -> list[Active]:
    """Causes that together leave the fit every parameter: inputs that all have a delay are not ahead as well."""
    structure, kept = base.solution.structure, list[Active]()
    own = {structure.key(s) for s in structure.slots}
    for active in actives:
        wide = replace(structure, actives=(*structure.actives, *kept, active))
        if own <= {wide.key(s) for s in wide.slots}:
            kept.append(active)
    return kept


def _in_place_of(fitted: Fitted, index: int, promise: Promise) -> Fitted:
    """A fit with two causes in place of one of its effects, under the same weights, from where they do nothing."""
    s = fitted.solution
    structure = s.structure.without(index)
    for cause in promise.causes:
        structure = structure.with_effect(cause)
    p = structure.carried(s.p, s.structure)
    prior = prior_of(structure, p, fitted)
    anchor, tolerance = first_states(fitted.problem), step_tolerance(fitted)
    found = solve(
        fitted.problem, structure, p, s.first, prior, anchor=anchor, budget=SETTLED, tolerance=tolerance
    )
    return Fitted(fitted.problem, prior, found)


def _refitted(base: Fitted, promise: Promise, tried: int) -> tuple[Judged, Judged]:
    """A pair refitted: the first alone, then both, from where they do nothing and from where the first alone ended."""
    first, second = promise.causes
    alone = screen_at(base, first, {}, base.solution.total)
    one = refit(base, alone)
    beside = screen_at(one, second, {}, one.solution.total)
    structure, problem = one.solution.structure.with_effect(second), base.problem
    prior, anchor = prior_of(structure, beside.unmoved, base), first_states(problem)
    ends = [
        solve(
            problem, structure, p, base.solution.first, prior, anchor=anchor, budget=SETTLED,
            tolerance=step_tolerance(base),
        )
        for p in (structure.carried(base.solution.p, base.solution.structure), beside.p)
    ]  # fmt: skip
    both = Fitted(problem, prior, min(ends, key=total))
    return judged_under(base, alone, one, tried), judged_under(one, beside, both, tried)


def _clearly_better(base: Fitted, reached: Fitted, both: Fitted, tried: int) -> bool:
    """Whether two causes are likelier than what was reached with one by more than chance, and worth a name."""
    return _preferred(reached, both, tried) and worthwhile(base, both)


def _preferred(fitted: Fitted, both: Fitted, tried: int) -> bool:
    """Whether a fit with two causes is likelier than another by more than chance, under the weights of the first."""
    if not np.isfinite(both.solution.total):
        return False
    by_chance = scatter(both, len(both.solution.structure.actives) - 1)
    gain = dispersed_cost(both.problem, fitted.solution) - dispersed_cost(both.problem, both.solution)
    more = max(1, len(both.solution.p) - len(fitted.solution.p))
    return gain / by_chance.ratio > least_gain(more, tried, by_chance.degrees)
