"""Which effects could be missing, and a quick look at each: what it would gain, to first order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.effect import Active, Effect, Variant
from identify.effects import EFFECTS
from identify.first_states import first_states, state_precision
from identify.fitted import Fitted
from identify.output_error import Prior, prior_for
from identify.reduction import reduce
from identify.regression import coefficient_scales
from identify.rough_fit import thin
from identify.structure import Structure
from identify.windows import moments
from preprocess.cores import side_by_side
from validate.motion_seen import Wanted
from validate.other_logs import of_windows
from validate.starts import starts_of

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Places = np.ndarray[tuple[int, ...], np.dtype[np.intp]]


#: What keeps parameters of a fit from standing in for one another without end, in units of their own information.
DAMPING = 1e-9
#: An effect is in no more than so many choices of the logs: three levels are loads or depths, one per log is neither.
MOST_CHOICES = 2


@dataclass(frozen=True)
class Screened:
    """A candidate, a start for its refit (and where it was looked at), and the gain that the first order promises.

    ``wanted`` is what the accelerations gain by it and the parameters that they want, where these were asked; whether
    it ``leads``: they want it so much that it is worth the way through shorter windows.
    """

    active: Active
    p: FloatArray
    unmoved: FloatArray
    gain: float
    wanted: Wanted | None = None
    leads: bool = False


def candidates(structure: Structure, effects: Sequence[Effect] = EFFECTS) -> list[Active]:
    """Every variant of every effect that makes sense here and is not in the structure yet; wiring is tested apart.

    What an input has in one form (a dead band) it does not have in another besides; inputs have it alike where all of
    them move. What bends an input about its zero is not looked at beside another that does.
    """
    in_some = Counter(a.effect.name for a in structure.actives if "logs" in a.variant.options)
    taken = {plainly_read(a).label for a in structure.actives}
    had = {(a.effect.name, name) for a in structure.actives for name in a.variant.inputs}
    return [
        active
        for effect in effects
        if not effect.rewire and in_some[effect.name] < MOST_CHOICES
        for variant in effect.variants(structure.setting)
        if (active := Active(effect, variant)).label not in taken
        if not had.intersection((effect.name, name) for name in variant.inputs)
        if not any(bend_alike(active, other) for other in structure.actives)
        if _moves(structure, active) and _all_move(structure, variant)
    ]


def bend_alike(one: Active, other: Active) -> bool:
    """Whether two causes bend what one input does about its zero."""
    both = all(a.effect.bends and a.effect.bends(a.variant.options) for a in (one, other))
    return both and not set(one.variant.inputs).isdisjoint(other.variant.inputs)


def plainly_read(active: Active) -> Active:
    """The same cause in the first of its forms."""
    if active.effect.forms is None:
        return active
    options = {k: v for k, v in active.variant.options.items() if k != "form"}
    return replace(active, variant=replace(active.variant, options=options))


def readings(active: Active) -> list[Active]:
    """A cause in each of its forms, itself first."""
    others = active.effect.forms(active.variant) if active.effect.forms else []
    return [active, *(replace(active, variant=variant) for variant in others)]


def _moves(structure: Structure, active: Active) -> bool:
    """Whether an effect has parameters in the equations that the model has."""
    return any(s.effect == len(structure.actives) for s in structure.with_effect(active).slots)


def _all_move(structure: Structure, variant: Variant) -> bool:
    """Whether none of several inputs keeps one value: what acts on that alike is the same without it."""
    halves = [structure.extents.get(name, (1.0, np.inf))[0] for name in variant.inputs]
    return len(halves) < 2 or min(halves) > 0.0


def wirings(structure: Structure, effects: Sequence[Effect] = EFFECTS) -> list[Active]:
    """Every way in which the inputs could be exchanged or reversed."""
    return [Active(e, v) for e in effects if e.rewire for v in e.variants(structure.setting)]


def smooth(active: Active) -> bool:
    """True where the cost has a slope at the effect's null, so that one look there is enough."""
    return not any(p.starts for p in active.effect.parameters)


def prior_of(structure: Structure, p: FloatArray, fitted: Fitted) -> Prior:
    """Prior of a structure on the stretches of a fit, with that fit's ridge."""
    scales = coefficient_scales(structure, p, fitted.problem.stretches)
    return prior_for(structure, scales, fitted.prior.ridge)


def screen(fitted: Fitted, actives: Sequence[Active]) -> list[Screened]:
    """First-order gain of each candidate from the fit of the structure without it, in its best form; best first."""
    easy = [a for a in actives if smooth(a)]
    found = _in_best_forms(fitted, easy) if easy else []
    found += from_starts(fitted, [a for a in actives if not smooth(a)])
    return sorted(found, key=lambda x: -x.gain)


def from_starts(fitted: Fitted, actives: Sequence[Active]) -> list[Screened]:
    """First-order gain of each candidate from the best of its own starts, over part of the windows."""
    some = thinned(fitted)
    base = _best_cost(some)
    share = some.problem.rows / fitted.problem.rows

    def look(active: Active) -> Screened:
        looks = [screen_at(some, active, start, base) for start in starts_of(fitted, active)]
        best = max(looks, key=lambda x: x.gain)
        return replace(best, gain=best.gain / share)

    return side_by_side(look, actives, shared=actives)


def thinned(fitted: Fitted) -> Fitted:
    """The same fit on some of its windows, enough of them to know the parameters."""
    problem, solution = fitted.problem, fitted.solution
    some = thin(problem, len(solution.p))
    part = of_windows(fitted, some)
    return replace(part, problem=replace(problem, windows=problem.windows[some]))


def extended(
    structure: Structure, p: FloatArray, actives: Sequence[Active]
) -> tuple[Structure, FloatArray, list[Places]]:
    """Structure with effects added, its parameters at their nulls, and where each effect's parameters are."""
    wide = replace(structure, actives=(*structure.actives, *actives))
    out = wide.carried(p, structure)
    first = len(structure.actives)
    places = [
        np.array([k for k, s in enumerate(wide.slots) if s.effect == first + j], dtype=int)
        for j in range(len(actives))
    ]
    return wide, out, places


def normal(fitted: Fitted, wide: Structure, p: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Information and score (priors included) of a structure at ``p``, with the fit's first states; and the cost."""
    solution, problem = fitted.solution, fitted.problem
    now = moments(problem, wide, p, solution.first)
    if not np.isfinite(now.cost):
        return np.eye(len(p)), np.zeros(len(p)), np.inf
    reduced = reduce(now.matrices, solution.first, first_states(problem), state_precision(wide))
    prior = prior_of(wide, p, fitted)
    weight = 1.0 / prior.sd**2
    information = reduced.information.sum(axis=0) + np.diag(weight)
    score = reduced.score.sum(axis=0) - weight * (p - prior.mean)
    return information, score, float(reduced.cost.sum() + np.sum(weight * (p - prior.mean) ** 2))


def _in_best_forms(fitted: Fitted, actives: Sequence[Active]) -> list[Screened]:
    """Each candidate in the form that promises most (by Akaike 1974); of those that promise the same in the first.

    A load that lets Coriolis terms be may promise nothing where it is all, for one that scales them as well.
    """
    read = [readings(a) for a in actives]
    found = iter(_screen_at_null(fitted, [reading for forms in read for reading in forms]))
    return [max([next(found) for _ in forms], key=_promise) for forms in read]


def _promise(screened: Screened) -> float:
    """Gain less what the parameters cost, to what can be told apart."""
    return round(screened.gain - 2.0 * len(screened.p), 3)


def _screen_at_null(fitted: Fitted, actives: Sequence[Active]) -> list[Screened]:
    """Gains of the first steps from where all candidates do nothing; none of what overflows on the fit's own path."""
    structure, p = fitted.solution.structure, fitted.solution.p
    wide, start, places = extended(structure, p, actives)
    information, score, _ = normal(fitted, wide, start)
    base = np.setdiff1d(np.arange(len(start)), np.concatenate(places))
    found = []
    for active, mine in zip(actives, places, strict=True):
        alone, at_null, [own] = extended(structure, p, [active])
        if not np.isfinite(information[np.ix_(mine, np.r_[base, mine])]).all():
            found.append(Screened(active, at_null, at_null, -np.inf))
            continue
        gain, step = _schur_gain(information, score, base, mine)
        q = at_null.copy()
        q[own] += within_reach(alone, own, q[own], step)
        found.append(Screened(active, q, at_null, gain))
    return found


def _schur_gain(
    information: FloatArray, score: FloatArray, base: Places, mine: Places
) -> tuple[float, FloatArray]:
    """Gain and step of the parameters ``mine`` with all ``base`` parameters free to follow."""
    left, rest, _ = reduced_to(information, score, base, mine)
    values, vectors = np.linalg.eigh(left)
    good = values > 1e-6
    along = vectors[:, good].T @ rest
    step = vectors[:, good] @ (along / values[good])
    return float(np.sum(along**2 / values[good])), step * _scale(information)[mine]


def reduced_to(
    information: FloatArray, score: FloatArray, base: Places, mine: Places
) -> tuple[FloatArray, FloatArray, float]:
    """Information and score of parameters ``mine``, all ``base`` free to follow, scaled; and what ``base`` gain alone.

    The scale is that of each parameter's own information.
    """
    scale = _scale(information)
    m, s = information * scale * scale[:, None], score * scale
    damped = m[np.ix_(base, base)] + DAMPING * np.eye(len(base))
    follow = np.linalg.solve(damped, np.column_stack([m[np.ix_(base, mine)], s[base]]))
    across = m[np.ix_(mine, base)]
    left = m[np.ix_(mine, mine)] - across @ follow[:, :-1]
    return left, s[mine] - across @ follow[:, -1], float(s[base] @ follow[:, -1])


def _scale(information: FloatArray) -> FloatArray:
    """Each parameter's size (np,) by its own information."""
    return np.asarray(1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300)))


def _gain_within(
    structure: Structure, information: FloatArray, score: FloatArray, p: FloatArray
) -> tuple[float, FloatArray]:
    """Gain and step (np,) of all parameters, but those that would leave their bounds from where they stand at one.

    A wind from the other side, pushing the other way, promises as much as the right one; but no wind does that.
    """
    low, high = (np.array([s.parameter.bounds[k] for s in structure.slots]) for k in (0, 1))
    free, step = np.ones(len(p), dtype=bool), np.zeros(len(p))
    while True:
        which = np.flatnonzero(free)
        gain, step[which] = _schur_gain(information, score, which[:0], which)
        leaves = free & (((p <= low) & (step < 0.0)) | ((p >= high) & (step > 0.0)))
        if not leaves.any():
            return gain, step
        free &= ~leaves
        step[leaves] = 0.0


def within_reach(structure: Structure, places: Places, at: FloatArray, step: FloatArray) -> FloatArray:
    """The step, cut to the bounds and to what a first order can be trusted for."""
    out = np.empty(len(step))
    for j, k in enumerate(places):
        slot = structure.slots[k]
        most = (
            np.inf
            if slot.coefficient >= 0
            else (3.0 if slot.parameter.starts else 30.0) * slot.parameter.scale
        )
        low, high = slot.parameter.bounds
        out[j] = np.clip(at[j] + np.clip(step[j], -most, most), low, high) - at[j]
    return out


def screen_at(fitted: Fitted, active: Active, start: Mapping[str, float], base: float) -> Screened:
    """Gain over the cost ``base`` of the first step from a start of the effect's own."""
    wide, p, [mine] = extended(fitted.solution.structure, fitted.solution.p, [active])
    for k in mine:
        p[k] = start.get(wide.slots[k].name, p[k])
    information, score, cost = normal(fitted, wide, p)
    if not (np.isfinite(cost) and np.isfinite(information).all()):
        return Screened(active, p, p, -np.inf)
    gain, step = _gain_within(wide, information, score, p)
    q = p.copy()
    q[mine] += within_reach(wide, mine, p[mine], step[mine])
    return Screened(active, q, p, base - cost + gain)


def _best_cost(fitted: Fitted) -> float:
    """Cost without a candidate after a step of the same kind: on part of the windows a fit is not at its best."""
    structure, p = fitted.solution.structure, fitted.solution.p
    information, score, cost = normal(fitted, structure, p)
    return cost - _gain_within(structure, information, score, p)[0]
