"""What was taken looked at again once others are in: rivals that are better, and the inputs as they were declared."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np

from identify.base_fit import fit_from_scratch
from identify.effect import Active, Variant
from identify.fitted import FAR, NEAR, Fitted
from identify.noise import dispersed_cost
from identify.regression import start_by_regression
from identify.structure import Structure, effects_alone
from validate.candidates import prior_of
from validate.judgement import INDISTINCT
from validate.log_groups import free_in_logs, in_logs, logs_of
from validate.look_alikes import Standing, dropped
from validate.refits import begun_at, under

#: Speeds at which a wind that nothing measured is tried, m/s, and steps of a refit.
SPEEDS, FOLLOWED = (2.0, 5.0, 10.0), 20

#: Two of a kind in different logs are one that loses no more than this share of what both explain: no model is true to
#: the last digit, nor are the stamps of every log.
LITTLE = 0.02


def likelier(fitted: Fitted, standing: Sequence[Standing], barred: Collection[str] = ()) -> Fitted | None:
    """A fit that the measurements prefer to what was taken, or that says as much with less; None without one.

    Effects whose names are ``barred`` come into nobody's place.
    """
    standing = [replace(s, rivals=tuple(r for r in s.rivals if _last(r) not in barred)) for s in standing]
    return better_rival(fitted, standing) or one_for_two(fitted, standing) or one_load_for_two(fitted)


def _last(fitted: Fitted) -> str:
    """Name of the effect that was added last."""
    return fitted.solution.structure.actives[-1].effect.name


def better_rival(fitted: Fitted, standing: Sequence[Standing]) -> Fitted | None:
    """Of the rivals of all effects the one that the measurements clearly prefer to what was taken; None without one.

    What was taken first was taken without what came later, which may be what makes its rival the better.
    """
    problem, cost = fitted.problem, dispersed_cost(fitted.problem, fitted.solution)
    better = {
        dispersed_cost(problem, r.solution) + 2.0 * (len(r.solution.p) - len(fitted.solution.p)): r
        for s in standing
        for r in s.rivals
    }
    least = min(better, default=np.inf)
    return better[least] if least < cost - INDISTINCT else None


def one_for_two(fitted: Fitted, standing: Sequence[Standing]) -> Fitted | None:
    """The fit with one effect in place of two that it could each stand for, if nothing speaks for two; None without.

    Every input that is late by as much as the others is one clock that is off: taken one by one they were delays.
    """
    enough = dispersed_cost(fitted.problem, fitted.solution) + INDISTINCT
    for one, other in permutations(standing, 2):
        named = {r.solution.structure.actives[-1].label for r in other.rivals}
        for rival in one.rivals:
            actives = [a.label for a in rival.solution.structure.actives]
            if actives[-1] not in named or other.active.label not in actives:
                continue
            simpler = dropped(rival, actives.index(other.active.label))
            if dispersed_cost(fitted.problem, simpler.solution) < enough:
                return simpler
    return None


def one_load_for_two(fitted: Fitted) -> Fitted | None:
    """The fit with one load, or shoal, in place of two in different logs, if little speaks for two; None without.

    What is in several logs alike is found in some of them first, and then in the others, there perhaps in another form:
    it has that of the two which is likelier.
    """
    actives = fitted.solution.structure.actives
    for pair in combinations(range(len(actives)), 2):
        if not _may_be_one(fitted.solution.structure, *(actives[k] for k in pair)):
            continue
        both = {str(n) for k in pair for n in logs_of(actives[k])}
        found = [dropped(in_logs(fitted, k, both), other) for k, other in (pair, pair[::-1])]
        simpler = min(found, key=lambda f: f.solution.total)
        lost = _more_than(fitted, simpler)
        if lost < INDISTINCT or lost < LITTLE * _more_than(
            fitted, dropped(dropped(fitted, pair[1]), pair[0])
        ):
            return simpler
    return None


def _more_than(fitted: Fitted, other: Fitted) -> float:
    """How much more another fit leaves."""
    return dispersed_cost(fitted.problem, other.solution) - dispersed_cost(fitted.problem, fitted.solution)


def _may_be_one(structure: Structure, one: Active, other: Active) -> bool:
    """Whether two effects are the same in different logs, which the measurements alone say."""
    alike = one.effect is other.effect and free_in_logs(one, structure) and free_in_logs(other, structure)
    return alike and not set(logs_of(one)) & set(logs_of(other))


def in_likeliest_form(fitted: Fitted) -> Fitted:
    """The fit with each effect in that of its forms which the measurements clearly prefer, the last one first.

    One that leaves more open is preferred where it is likelier at all (Akaike 1974): it only assumes less.
    """
    for index in reversed(range(len(fitted.solution.structure.actives))):
        active, best = fitted.solution.structure.actives[index], fitted
        for variant in active.effect.forms(active.variant) if active.effect.forms else ():
            found = under(fitted.problem, _read_as(fitted, index, variant), 20)
            more = len(found.solution.p) - len(best.solution.p)
            if found.solution.total < best.solution.total - (2.0 * more or INDISTINCT):
                best = found
        fitted = best
    return fitted


def _read_as(fitted: Fitted, index: int, variant: Variant) -> Fitted:
    """The same values with one effect in another form; what that has besides begins at nothing."""
    s = fitted.solution
    actives = list(s.structure.actives)
    actives[index] = replace(actives[index], variant=variant)
    structure = replace(s.structure, actives=tuple(actives))
    values = {(slot.effect, slot.name): v for slot, v in zip(s.structure.slots, s.p, strict=True)}
    p = np.array([values.get((slot.effect, slot.name), slot.parameter.null) for slot in structure.slots])
    there = replace(fitted, solution=replace(s, structure=structure, p=p))
    return there if len(p) == len(s.p) else replace(there, prior=prior_of(structure, p, fitted))


def at_likeliest_speed(fitted: Fitted) -> Fitted:
    """The fit with a wind that nothing measured at the speed that the measurements want.

    A slow wind on large areas pushes nearly as a fast one on small ones, and a search ends where it began between them.
    Off the noise the hull may have been bent to a wrong one, and is begun anew with each speed too.
    """
    structure, p = fitted.solution.structure, fitted.solution.p
    winds = [k for k, a in enumerate(structure.actives) if a.effect.air]
    if not winds:
        return fitted
    mine = [(k, s.coefficient >= 0) for k, s in enumerate(structure.slots) if s.effect == winds[0]]
    areas, flow = ([k for k, linear in mine if linear is which] for which in (True, False))
    speed, best = float(np.hypot(*p[flow])), fitted
    for other in SPEEDS if speed > 0.0 else ():
        q = p.copy()
        q[flow] *= other / speed
        anew = start_by_regression(structure, effects_alone(structure, q), fitted.problem.stretches)
        q[areas] = anew[areas]
        for begin in (q, anew) if fitted.chi2_per_dof > NEAR else (q,):
            found = begun_at(fitted, begin, FOLLOWED)
            best = min(best, found, key=lambda f: f.solution.total)
    return best


def as_good_as_declared(fitted: Fitted) -> Fitted | None:
    """The fit with the inputs as declared, if it is as near once all that was missing is in; None else.

    A push that was missing when the wirings were compared may have looked like a propeller's.
    """
    if fitted.chi2_per_dof > FAR:
        return None
    structure = fitted.solution.structure
    declared = structure.without(next(k for k, a in enumerate(structure.actives) if a.effect.rewire))
    p = effects_alone(declared, declared.carried(fitted.solution.p, structure))
    stretches, length = fitted.problem.stretches, fitted.problem.length
    found = under(fitted.problem, fit_from_scratch(declared, stretches, p, length=length, rounds=0), 20)
    return found if found.solution.total < fitted.solution.total + INDISTINCT else None
