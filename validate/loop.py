"""The loop: find what is missing, take it, look again, and check that everything taken still stands."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from identify.base_fit import LONG, fit_from_scratch, fit_states, window_length
from identify.bent_paths import bent
from identify.fitted import FAR, NEAR, Fitted
from identify.prepare import Prepared
from identify.structure import Structure
from identify.windows import Problem, cut
from validate.at_its_best import settled
from validate.clocks import fewer_clocks
from validate.each_input import on_each_input
from validate.exchange import as_good_as_declared, at_likeliest_speed, likelier
from validate.finalists import astray
from validate.nearer import HALF, as_near, came_there, clearly_nearer, nearer_in_windows_alike, worth_another
from validate.on_its_way import on_its_way
from validate.outcome import Outcome, all_standing
from validate.pace import Pace
from validate.pairs import two_for_one
from validate.preferred_wiring import Otherwise, preferred_wiring, wired_otherwise
from validate.pruning import pruned
from validate.refined import refined
from validate.rounds import MOST_EFFECTS, Turn, rounds
from validate.swapped_times import with_times_swapped
from validate.swell import with_waves_known
from validate.wiring import Wiring
from validate.within import ALL, First, GivenUp, Within

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Above this cost per degree of freedom over short windows, long ones would only add to the confusion.
HOPELESSLY_FAR = 20.0
#: So many effects are many: what is behind them may be fewer.
MANY = 3
#: So many times a taken effect may be exchanged for a rival.
EXCHANGES = 3
#: Length of the windows for the first, rough pass, s, where those of the last are ``LONG``.
ROUGH = 10.0


def search(
    prepared: Prepared, declared: Fitted | None = None, pace: Pace | None = None, within: Within = ALL
) -> Outcome:
    """Search for what the declared model lacks, on the logs to identify on.

    ``declared`` is the declared model's windowed output error fit, where there is one: near the noise the search goes
    on from there; else it begins with short windows, in which a model that lacks much cannot run away. What the
    accelerations say of the wiring is believed where the search with it comes near the noise; else the inputs as they
    were declared are searched with too: an antenna that is far off, or a current, can make a wiring look wrong. Where
    they say nothing clearly, what they would rather have is tried: first if the declared model is far from the noise
    and comes to it with another wiring alone, else last, if the search stays off the noise.
    """
    pace = pace or Pace()
    wiring = preferred_wiring(prepared, declared)
    if wiring is None:
        far = declared is None or declared.is_far
        otherwise = wired_otherwise(prepared, _rough(prepared.structure)) if far else None
        if otherwise and otherwise.chi2 < NEAR and otherwise.declared > FAR:
            wiring = otherwise.wiring
        else:
            found = _searched(prepared, declared, None, pace, within)
            found = _begun_otherwise(prepared, declared, found, pace, within)
            found = _begun_shorter(prepared, found, pace, within)
            if not found.fitted.is_off and len(found.standing) < MANY:
                return found
            otherwise = otherwise if far else wired_otherwise(prepared, _rough(prepared.structure))
            return _otherwise_wired(prepared, found, otherwise, pace, within)
    pace(f"taken: {wiring.active.label}")
    found = _searched(prepared, declared, wiring, pace, within)
    if found.fitted.chi2_per_dof < FAR:
        return found
    pace("the inputs as they were declared")
    other = _searched(prepared, declared, None, pace, within)
    return other if nearer_in_windows_alike(other.fitted, found.fitted) else found


def _otherwise_wired(
    prepared: Prepared, found: Outcome, otherwise: Otherwise | None, pace: Pace, within: Within
) -> Outcome:
    """The search with a wiring that the accelerations prefer, if not clearly, where that comes near; else as it was.

    Where many effects came to the noise, they may make up for it: fewer that come there with it are believed.
    """
    if otherwise is None or not otherwise.chi2 < min(FAR, HALF * otherwise.declared):
        return found
    pace(f"taken: {otherwise.wiring.active.label}")
    other = _searched(prepared, None, otherwise.wiring, pace, within)
    near = other.fitted.chi2_per_dof < FAR and clearly_nearer(other.fitted, found.fitted)
    there = not other.fitted.is_off and (found.fitted.is_off or len(other.standing) < len(found.standing))
    return other if near or there else found


def _begun_otherwise(
    prepared: Prepared, declared: Fitted | None, found: Outcome, pace: Pace, within: Within
) -> Outcome:
    """A search that took several effects and came near the noise, not to it; or one without the first, if that does.

    Far from the noise what takes most away may be none of the causes, and those that are taken after it make up for it:
    where that took many of them, a search that comes as near with fewer is believed too.
    """
    taken = [turn.taken.screened.active for turn in found.turns if turn.taken]
    kept = {s.active.effect.name for s in found.standing}
    many = len(kept) >= MANY
    if not (many or (len(kept) > 1 and worth_another(found.fitted))) or taken[0].effect.name not in kept:
        return found
    pace(f"without {taken[0].label}")
    barred = within.barred | {taken[0].effect.name}
    first = First(found.fitted.chi2_per_dof, len(kept), at_noise=not found.fitted.is_off)
    with suppress(GivenUp):
        other = _searched(prepared, declared, None, pace, replace(within, barred=barred, first=first))
        plainer = many and len(other.standing) < len(kept) and as_near(other.fitted, found.fitted)
        return other if plainer or came_there(other.fitted, found.fitted) else found
    return found


def _searched(
    prepared: Prepared, declared: Fitted | None, wiring: Wiring | None, pace: Pace, within: Within = ALL
) -> Outcome:
    """The search with the inputs wired in one way, within what it keeps to."""
    structure = prepared.structure.with_effect(wiring.active) if wiring else prepared.structure
    turns: list[Turn] = []
    if declared is not None and not wiring and tells(declared):
        fine = _gone_on_with(declared, turns, pace, within)
    else:
        pace("a first rough fit")
        fine = fit_from_scratch(structure, prepared.identify, length=_rough(structure))
        fine = _lengthened(rounds(fine, turns, pace, FAR, within), turns, pace, within)
    return _ended(fine, turns, wiring, pace, within)


def _rough(structure: Structure) -> float:
    """Length of the windows for a first, rough pass, s."""
    return window_length(structure.vessel.length) * ROUGH / LONG


def _begun_shorter(prepared: Prepared, found: Outcome, pace: Pace, within: Within) -> Outcome:
    """A search that ended near the noise, not at it; or one that takes over short windows what it can, if nearer.

    Over long ones what is missing may bend a fit until no single effect helps it, where over short ones it is hardly
    off. What looked there first has taken it already.
    """
    length = _rough(prepared.structure)
    looked = bool(found.turns) and not found.turns[0].base.problem.length > length
    if looked or not found.fitted.is_off or found.fitted.chi2_per_dof > FAR:
        return found
    pace("over short windows")
    turns: list[Turn] = []
    begun = fit_from_scratch(prepared.structure, prepared.identify, length=length)
    near = rounds(begun, turns, pace, within=within)
    if not any(t.taken for t in turns) or _no_nearer(found.fitted, near):
        return found
    with suppress(GivenUp):
        held = replace(within, first=First(found.fitted.chi2_per_dof))
        other = _ended(_lengthened(near, turns, pace, held), turns, None, pace, within)
        return other if came_there(other.fitted, found.fitted) else found
    return found


def _no_nearer(found: Fitted, near: Fitted) -> bool:
    """Whether what is taken over short windows brings a fit no nearer by its own; what it has already, not clearly."""
    had, has = (frozenset(a.label for a in f.solution.structure.actives) for f in (found, near))
    there = refined(near, found.problem.length)
    return (has <= had or there.astray_by > found.astray_by) and not came_there(there, found)


def _ended(fine: Fitted, turns: list[Turn], wiring: Wiring | None, pace: Pace, within: Within) -> Outcome:
    """What rounds came to, without what does not stand, and with what the measurements prefer."""
    fine = with_times_swapped(on_its_way(pruned(fine, pace)))
    if wiring and (plain := as_good_as_declared(fine)):
        fine, wiring = pruned(plain, pace), None
    return _exchanged(fine, turns, wiring, pace, within)


def searched_on(outcome: Outcome, within: Within, pace: Pace) -> Outcome:
    """The search gone on with without what was taken back, and is barred: it may have stood for waves."""
    turns = list(outcome.turns)
    fine = pruned(rounds(with_waves_known(outcome.fitted), turns, pace, within=within), pace)
    found = _exchanged(fine, turns, outcome.wiring, pace, within)
    return replace(found, refuted=outcome.refuted, unsure=outcome.unsure, slight=outcome.slight)


def _exchanged(fine: Fitted, turns: list[Turn], wiring: Wiring | None, pace: Pace, within: Within) -> Outcome:
    """What was found, with what the measurements clearly prefer in its place, and what could stand there as well."""
    standing = all_standing(fine, wiring, pace, turns)
    for _ in range(EXCHANGES):
        rival = likelier(fine, standing, within.barred) or fewer_clocks(fine)
        if rival is None and len(fine.solution.structure.actives) < MOST_EFFECTS:
            rival = two_for_one(fine, within.barred)
        if rival is None:
            break
        pace(f"exchanged: {rival.solution.structure.actives[-1].label}")
        fine = pruned(rounds(pruned(on_each_input(settled(rival)), pace), turns, pace, within=within), pace)
        standing = all_standing(fine, wiring, pace, turns)
    return Outcome(fine, tuple(turns), standing, wiring)


def tells(declared: Fitted) -> bool:
    """Whether a fit is near the noise, and not in short windows alone, whose first states hide what it lacks.

    Short ones do where the fit follows its own logs, and is near the noise in long ones too, or these are bent by the
    rounding of the inputs.
    """
    problem, s = declared.problem, declared.solution
    longest = window_length(s.structure.vessel.length)
    if not declared.chi2_per_dof < FAR:
        return False
    if problem.length >= longest * ROUGH / LONG:
        return True
    if astray(declared):
        return False
    longer = _cut_as(declared, longest)
    there = replace(declared, problem=longer, solution=fit_states(longer, s.structure, s.p))
    return there.chi2_per_dof < FAR or bent(longer) > 1.0


def _gone_on_with(declared: Fitted, turns: list[Turn], pace: Pace, within: Within) -> Fitted:
    """Rounds from a fit near the noise, in longer windows too where it had run away, unless rounded inputs bend those.

    What is far from the noise there once more is left as it was in the shorter ones, and its rounds are none.
    """
    near = rounds(declared, turns, pace, within=within)
    longest, count = window_length(near.solution.structure.vessel.length), len(turns)
    if near.problem.length >= longest or bent(_cut_as(near, longest)) > 1.0:
        return near
    with suppress(GivenUp):
        longer = _lengthened(near, turns, pace, within)
        if longer.chi2_per_dof < FAR:
            return longer
    del turns[count:]
    return near


def _cut_as(fitted: Fitted, length: float) -> Problem:
    """A fit's logs cut to windows of another length, under its weights."""
    return cut(fitted.problem.stretches, length).weighted_as(fitted.problem)


def _lengthened(fitted: Fitted, turns: list[Turn], pace: Pace, within: Within) -> Fitted:
    """Rounds over ever longer windows: what runs away in long ones may show in short ones, and the other way round.

    Waves show in long ones, and a fit that knows of them has the longest already: what came to nothing there is not
    looked at again. Where nothing is left to take and the fit stays far off, the next look is in the longest, or in the
    first that throw it farther off still.
    """
    longest, length = window_length(fitted.solution.structure.vessel.length), fitted.problem.length
    if length >= longest and not _came_to_nothing(turns):
        return rounds(fitted, turns, pace, within=within)
    if length >= longest and within.first.is_out_of_reach(fitted, stuck=True):
        raise GivenUp
    while length < longest and fitted.chi2_per_dof < HOPELESSLY_FAR:
        stuck = fitted.is_far and _came_to_nothing(turns)
        length = min(2.0 * length, longest)
        fitted = at_likeliest_speed(refined(fitted, length))
        fitted = with_waves_known(fitted) if within.waves else fitted
        if length == longest or not stuck or fitted.chi2_per_dof >= HOPELESSLY_FAR:
            fitted = rounds(fitted, turns, pace, 0.0 if length == longest else FAR, within)
    return fitted


def _came_to_nothing(turns: list[Turn]) -> bool:
    return bool(turns) and turns[-1].taken is None
