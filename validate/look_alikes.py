"""What could stand in place of an effect that was taken: signatures that overlap, then refits of those that do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.base_fit import fit_from_scratch, window_length
from identify.effect import Active
from identify.first_states import first_states
from identify.fitted import Fitted
from identify.in_common import in_common
from identify.noise import dispersed_cost
from identify.output_error import solve
from identify.structure import Structure, effects_alone
from preprocess.cores import side_by_side
from validate.candidates import (
    Screened,
    candidates,
    extended,
    from_starts,
    normal,
    prior_of,
    smooth,
)
from validate.judgement import INDISTINCT, significance
from validate.refits import step_tolerance, under
from validate.same_cause import is_rival, of_all_others
from validate.scan import between_log_and_hull
from validate.score_scatter import scatter
from validate.twins import on_twins

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: A rival is refitted where to first order it would lose less than this, plus a small share of the effect's gain.
CLOSE, SHARE = 40.0, 0.02
#: At most this many rivals are refitted.
MOST_RIVALS = 6
#: Steps of a search without an effect.
BUDGET = 20
#: An effect whose loss is more than this to first order need not be left out to know that.
BEYOND_DOUBT = 1000.0


@dataclass(frozen=True)
class Standing:
    """An effect in a fit: what dropping it would cost, its p-value, and what could stand in its place (refitted)."""

    active: Active
    gain: float
    p_value: float
    look_alikes: tuple[str, ...]
    rivals: tuple[Fitted, ...] = ()


def dropped(fitted: Fitted, index: int) -> Fitted:
    """The fit without one of its effects, everything else free, under the same weights.

    Begun from the fit with it, or anew where that runs away without it.
    """
    return fitted.remembered(_dropped, index)


def _dropped(fitted: Fitted, index: int) -> Fitted:
    """The same, made anew."""
    return refitted_as(fitted, fitted.solution.structure.without(index))


def refitted_as(fitted: Fitted, structure: Structure) -> Fitted:
    """The fit of another structure under the same weights; begun and, where need be, begun anew as in ``dropped``."""
    solution = fitted.solution
    p = structure.carried(solution.p, solution.structure)
    prior = prior_of(structure, p, fitted)
    found = solve(
        fitted.problem, structure, p, solution.first, prior,
        anchor=first_states(fitted.problem), budget=BUDGET, tolerance=step_tolerance(fitted),
    )  # fmt: skip
    if np.isfinite(found.cost):
        return Fitted(fitted.problem, prior, found)
    length = min(fitted.problem.length, window_length(structure.vessel.length))
    anew = fit_from_scratch(structure, fitted.problem.stretches, effects_alone(structure, p), length=length)
    return under(fitted.problem, replace(anew, prior=prior), BUDGET)


def losses_without(fitted: Fitted, some: Sequence[int]) -> dict[int, float]:
    """What dropping each of some effects would cost."""
    doubted = [k for k in some if not _beyond_doubt(fitted, k)]
    fitted.remembered.each(_dropped, doubted, in_common(fitted))
    return {k: loss_without(fitted, k) for k in some}


def loss_without(fitted: Fitted, index: int) -> float:
    """What dropping an effect would cost: to first order where that is much, else by refit."""
    if loss := _beyond_doubt(fitted, index):
        return loss
    without = dropped(fitted, index).solution
    return dispersed_cost(fitted.problem, without) - dispersed_cost(fitted.problem, fitted.solution)


def _beyond_doubt(fitted: Fitted, index: int) -> float | None:
    """What dropping an effect would cost to first order, where that is so much that it need not be tried."""
    mine, away = departure(fitted, index)
    information, _, _ = normal(fitted, fitted.solution.structure, fitted.solution.p)
    others = np.setdiff1d(np.arange(len(information)), mine)
    linear = float(away @ left_on(information, others, mine) @ away)
    linear /= float(np.max(fitted.problem.dispersion)) ** 2
    sure = linear > BEYOND_DOUBT and smooth(fitted.solution.structure.actives[index])
    return linear if sure else None


def departure(fitted: Fitted, index: int) -> tuple[IntArray, FloatArray]:
    """Places of an effect's parameters, and how far they are from where it is nothing."""
    slots = fitted.solution.structure.slots
    mine = np.array([k for k, s in enumerate(slots) if s.effect == index], dtype=np.int64)
    null = np.array([0.0 if slots[k].coefficient >= 0 else slots[k].parameter.null for k in mine])
    return mine, fitted.solution.p[mine] - null


def _unit_diagonal(information: FloatArray) -> tuple[FloatArray, FloatArray]:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    return information * scale * scale[:, None], scale


def _follow(m: FloatArray, others: IntArray, mine: IntArray) -> FloatArray:
    """How ``others`` move per move of ``mine``, to first order (unit diagonal)."""
    return np.asarray(
        np.linalg.solve(m[np.ix_(others, others)] + 1e-9 * np.eye(len(others)), m[np.ix_(others, mine)]),
        dtype=float,
    )


def left_on(information: FloatArray, others: IntArray, mine: IntArray) -> FloatArray:
    """Information on ``mine`` that is left when ``others`` are free to follow."""
    m, scale = _unit_diagonal(information)
    left = m[np.ix_(mine, mine)] - m[np.ix_(mine, others)] @ _follow(m, others, mine)
    return np.asarray(left / np.outer(scale[mine], scale[mine]), dtype=float)


def standing(fitted: Fitted, index: int, beside: Sequence[Screened] = ()) -> Standing:
    """Judge one effect of a fit: its gain, and every rival that would explain as much in its place.

    Rivals are those whose signatures overlap with its, and those ``beside`` them, each with a start.
    """
    structure = fitted.solution.structure
    active = structure.actives[index]
    gain = loss_without(fitted, index)
    among = {s.name for s in fitted.problem.stretches}
    rivals = [a for a in candidates(structure.without(index)) if is_rival(active, a, among)]
    twins = on_twins(fitted, index, rivals)
    alike = {s.active.label for s in twins}
    known = {s.active.label: s for s in (*beside, *twins) if is_rival(active, s.active, among)}
    overlapping = [s for s in _overlapping(fitted, index, rivals, gain) if s.active.label not in known]
    close = [*overlapping, *known.values()]
    tried = side_by_side(
        lambda a: _as_good(fitted, index, a, close_to(gain) if a.active.label in alike else 0.0),
        close,
        shared=[*in_common(fitted), *(a.active for a in close)],
    )
    near = [(a, fit) for a, fit in zip(close, tried, strict=True) if fit is not None]
    k, by_chance = len(departure(fitted, index)[0]), scatter(fitted, index)
    p_value = significance(gain, k, len(rivals) + 1, by_chance)
    others = [a.active for a, _ in near if not of_all_others(active, a.active, among)]
    names = tuple(dict.fromkeys(_named(other, active) for other in others))
    return Standing(active, gain, p_value, names, tuple(fit for _, fit in near))


def _overlapping(fitted: Fitted, index: int, rivals: list[Active], gain: float) -> list[Screened]:
    """Rivals whose signature covers the effect's, most of it first, each with a start for its refit."""
    easy = [a for a in rivals if smooth(a)]
    slow = [[a] for a in rivals if not smooth(a)]
    found = [s for group in ([easy, *slow] if easy else slow) for s in _close(fitted, index, group, gain)]
    found = sorted(found, key=lambda s: -s.gain)[:MOST_RIVALS]
    seen = {s.active.label for s in found}
    return found + [s for s in _kin(fitted, index, rivals) if s.active.label not in seen]


def _kin(fitted: Fitted, index: int, rivals: list[Active]) -> list[Screened]:
    """Rivals that act on the same input between log and hull, each effect's best form at its own starts.

    Near nothing their signatures tell little of what they would make of the same input, nor does a start that is off.
    """
    mine = fitted.solution.structure.actives[index]
    if not between_log_and_hull(mine):
        return []
    kin = [
        a
        for a in rivals
        if between_log_and_hull(a) and not smooth(a)
        if a.variant.input is None or mine.variant.input in a.variant.inputs
    ]
    best: dict[str, Screened] = {}
    for s in sorted(from_starts(dropped(fitted, index), kin), key=lambda s: -s.gain):
        best.setdefault(s.active.effect.name, s)
    return list(best.values())


def _close(fitted: Fitted, index: int, group: list[Active], gain: float) -> list[Screened]:
    wide, p, places = extended(fitted.solution.structure, fitted.solution.p, group)
    for k in np.concatenate(places):
        slot = wide.slots[k]
        p[k] = _just_off(slot.parameter.starts, slot.parameter.null) if slot.coefficient < 0 else 0.0
    information, _, cost = normal(fitted, wide, p)
    if not np.isfinite(cost):
        return []
    effect, away = departure(fitted, index)
    effect = _translated(fitted.solution.structure, wide, effect)
    rest = np.setdiff1d(np.arange(len(information)), np.concatenate([effect, *places]))
    found = []
    for active, mine in zip(group, places, strict=True):
        others = np.concatenate([rest, mine])
        loss = float(away @ left_on(information, others, effect) @ away)
        if loss < close_to(gain) * float(np.max(fitted.problem.dispersion)) ** 2:
            m, scale = _unit_diagonal(information)
            move = np.zeros(len(p))
            move[others] = scale[others] * (_follow(m, others, effect) @ (away / scale[effect]))
            start = _start(fitted, index, wide, p + move, active)
            found.append(Screened(active, start, start, -loss))
    return found


def _just_off(starts: tuple[float, ...], null: float) -> float:
    """A place near the null at which an effect has a slope."""
    near = min(starts, key=abs) if starts and null == 0.0 else None
    return 0.1 * near if near else null


def _translated(narrow: Structure, wide: Structure, places: IntArray) -> IntArray:
    """Places of the same slots in a structure with more effects."""
    where = {wide.key(s): k for k, s in enumerate(wide.slots)}
    return np.array([where[narrow.key(narrow.slots[k])] for k in places], dtype=np.int64)


def _start(fitted: Fitted, index: int, wide: Structure, moved: FloatArray, active: Active) -> FloatArray:
    """Parameters of the structure with the rival in the effect's place, from those of the one that has them all."""
    target = fitted.solution.structure.without(index).with_effect(active)
    p = target.carried(moved, wide)
    return np.array([np.clip(v, *s.parameter.bounds) for v, s in zip(p, target.slots, strict=True)])


def _as_good(fitted: Fitted, index: int, rival: Screened, alike: float = 0.0) -> Fitted | None:
    """A rival refitted in the effect's place, where it comes within what can be told apart, or is ``alike`` besides."""
    structure = fitted.solution.structure.without(index).with_effect(rival.active)
    prior = prior_of(structure, rival.p, fitted)
    margin = margin_for(len(fitted.solution.p) - len(rival.p), fitted.problem.rows) + alike
    slack = margin * float(np.max(fitted.problem.dispersion)) ** 2
    found = solve(
        fitted.problem, structure, rival.p, fitted.solution.first, prior, anchor=first_states(fitted.problem),
        budget=15, target=fitted.solution.total + slack + 20.0,
    )  # fmt: skip
    if not np.isfinite(found.total):
        return None
    near = dispersed_cost(fitted.problem, found) < dispersed_cost(fitted.problem, fitted.solution) + margin
    fit = Fitted(fitted.problem, prior, found)
    return fit if near and blows(fit) else None


def close_to(gain: float) -> float:
    """What a rival of an effect with such a gain may lose, to first order or when judged, and be worth a refit."""
    return CLOSE + SHARE * gain


def blows(fitted: Fitted) -> bool:
    """Whether the last effect of a fit, if it is a wind, is told from air at rest, which is damping by another name."""
    structure, p = fitted.solution.structure, fitted.solution.p
    last = len(structure.actives) - 1
    if not structure.actives[last].effect.air:
        return True
    information, _, _ = normal(fitted, structure, p)
    speed = np.array([k for k, s in enumerate(structure.slots) if s.effect == last and s.coefficient < 0])
    left = left_on(information, np.setdiff1d(np.arange(len(information)), speed), speed)
    told = p[speed] @ left @ p[speed] / float(np.max(fitted.problem.dispersion)) ** 2
    return bool(told > INDISTINCT)


def margin_for(more: int, rows: int) -> float:
    """By how much a rival may be less likely, in -2 log likelihood, and still stand in an effect's place.

    A parameter ``more`` than the rival has is worth what chance gives it (Akaike 1974), and makes all that it could
    have been less probable: by the logarithm of the rows (Schwarz 1978).
    """
    return INDISTINCT + more * (max(2.0, np.log(rows)) if more > 0 else 2.0)


def _named(other: Active, active: Active) -> str:
    return other.effect.name if other.effect.name != active.effect.name else other.label
