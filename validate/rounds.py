"""Rounds of the loop: look at every cause, take one, or two that only together explain, until none is left to take."""

from __future__ import annotations

from dataclasses import dataclass, replace

from identify.fitted import FAR, NEAR, SLOWLY, Fitted
from identify.noise import recalibrated
from validate.at_its_best import settled
from validate.candidates import Screened, candidates, screen
from validate.consistency import consistent
from validate.each_input import on_each_input
from validate.exchange import at_likeliest_speed, in_likeliest_form
from validate.finalists import FINALISTS, astray, finalists
from validate.instead_of_wander import instead_of_wander
from validate.judgement import Judged, at_bound, beyond_doubt, judge, plainest, worthwhile
from validate.log_sets import in_likeliest_sets, ways
from validate.pace import ANOTHER, LAST, Pace
from validate.pairs import best_pair
from validate.pruning import fewer, pruned
from validate.pushes import with_pushes_anew, with_pushes_known
from validate.refits import under
from validate.sizes import at_likeliest_size
from validate.slight_compass import with_slight_compass_known
from validate.swell import with_waves_known, without_waves
from validate.swing_scan import swings
from validate.wander import with_wander_anew, with_wander_known
from validate.within import ALL, NONE, GivenUp, Names, Within

#: No campaign lacks more than this many effects that can be found, terms of a model that is too simple among them.
MOST_EFFECTS = 6
#: A fit that is found on the way is gone on with below this share of the other's cost per degree of freedom.
NEARER = 0.98
#: ... and looked at again so many times.
LOOKS_AGAIN = 2
#: So many of the nearest are looked at as one of two that are missing, those that leave no more than this share of the
#: squared errors.
FIRST_OF_PAIRS, PROMISING = 2, 0.8
#: Near the noise the likeliest cause is looked at as one of two, if chance gives its gain in fewer than this share.
SURELY = 1e-4


@dataclass(frozen=True)
class Turn:
    """One round: the fit without, all screened candidates, those that were refitted, and what was taken."""

    base: Fitted
    screened: tuple[Screened, ...]
    judged: tuple[Judged, ...]
    taken: Judged | None


def rounds(
    fitted: Fitted, turns: list[Turn], pace: Pace, enough: float = 0.0, within: Within = ALL
) -> Fitted:
    """Take one effect after the other, until none is left to take or the cost per degree of freedom is low enough.

    Raises
    ------
    GivenUp
        Where the search that it is held against (``within``) is out of its reach.
    """
    again, repeats, cut, waves, barred = 0, False, False, None, within.barred
    fitted, looked = _with_slow_errors_known(fitted, pace, barred)
    while fitted.chi2_per_dof > enough or (looked and looked[0] is fitted):
        if within.first.is_out_of_reach(fitted, stuck=False):
            raise GivenUp
        if within.first.is_as_good(fitted):
            fitted, cut = fewer(fitted, pace, cut), True
            continue
        if fitted.problem.swell not in (None, waves):
            waves, instead = fitted.problem.swell, _swinging(fitted, pace, barred)
            if instead:
                turns.append(instead[0])
                fitted = instead[1]
                continue
            fitted = pruned(fitted, pace)  # what was taken without may have followed them
        turn = looked[1] if looked and looked[0] is fitted else _turn(fitted, pace, barred, again=repeats)
        looked = None
        wandering = _wandering(turn)
        if wandering:
            fitted = wandering
            continue
        if turn.taken is None:
            cause = instead_of_wander(turn.base, turn.judged, len(turn.screened))
            turn = replace(turn, taken=cause) if cause else _beside_pushes(turn, pace, barred)
        if turn.taken is None and within.first.is_out_of_reach(fitted, stuck=True):
            raise GivenUp
        if turn.taken is None and fitted.chi2_per_dof > NEAR and not astray(fitted):
            turn = _thorough(turn, pace, barred)
        swaying = _in_waves(fitted, turn) if within.waves else None
        if swaying:
            fitted = swaying
            continue
        looks = turn.taken is None and again < LOOKS_AGAIN
        if looks and (nearer := _nearer(fitted, turn.base)) is not fitted:
            turns.append(turn)
            fitted, again, repeats = nearer, again + 1, True
            continue
        new = _together(turn, pace, barred) or ([turn] if turn.taken else _in_pairs(turn, pace, barred))
        turns += new
        taken = new[-1].taken
        if taken is None or len(fitted.solution.structure.actives) >= MOST_EFFECTS:
            return _nearer(fitted, turn.base)
        pace(f"taken: {taken.label}")
        fitted, repeats = _after(taken, within.waves), False
    return fitted


def _with_slow_errors_known(
    fitted: Fitted, pace: Pace, barred: Names
) -> tuple[Fitted, tuple[Fitted, Turn] | None]:
    """A fit that knows of slow errors for which no cause is sought: a receiver's, or those of any compass.

    A compass's are believed where no one cause takes all of them: in a good compass a slow actuator shows no larger.
    The second is the round in which that was looked for, where one does, and the fit that it began with.
    """
    if not fitted.is_off:
        return with_wander_known(fitted), None
    known = with_slight_compass_known(fitted)
    turn = None if known is fitted else _turn(fitted, pace, barred)
    taken = turn.taken if turn else None
    cause = taken is not None and not taken.fitted.is_off and taken.fitted.slow < SLOWLY
    return (fitted, (fitted, turn)) if turn and cause else (known, None)


def _nearer(fitted: Fitted, base: Fitted) -> Fitted:
    """A fit; or what a look at other causes made of it, where that is clearly nearer the noise by the same weights.

    Weights that give up what is far off may lead away from it again: the nearest is gone on with.
    """
    if not base.solution.total < NEARER * under(base.problem, fitted, 3).solution.total:
        return fitted
    again = under(recalibrated(base.problem, base.solution), base, 20)
    return min(fitted, again, base, key=lambda f: f.astray_by)


def _thorough(turn: Turn, pace: Pace, barred: Names) -> Turn:
    """A round that came to nothing gone on with: the best of every effect and form but for what it refitted."""
    other = _turn(turn.base, pace, barred, thorough=True, but=frozenset(j.label for j in turn.judged))
    return replace(other, judged=(*other.judged, *turn.judged))


def _turn(
    fitted: Fitted,
    pace: Pace,
    barred: Names = NONE,
    thorough: bool = False,
    again: bool = False,
    but: Names = NONE,
) -> Turn:
    """One round: every candidate looked at, the most promising refitted and judged, one taken or none.

    If it is to be ``thorough``, the best of every effect and form, whatever a first order promises, ``but`` for some
    labels. When it looks ``again``, nothing leads: a fit from scratch is what it was.
    """
    actives = [a for a in candidates(fitted.solution.structure) if a.effect.name not in barred]
    pace.expect(1 + FINALISTS, ANOTHER + LAST)
    pace(f"a look at {len(actives)} causes")
    screened = screen(fitted, [*actives, *in_likeliest_sets(fitted, actives)])
    chosen = [s for s in finalists(fitted, screened, thorough) if s.active.label not in but]
    chosen = [replace(s, leads=False) for s in chosen] if again else chosen
    pace.expect(len(chosen), (ANOTHER if chosen else 0.0) + LAST)
    base, judged = (
        judge(fitted, chosen, len(actives), pace, ways(fitted, actives)) if chosen else (fitted, [])
    )
    worth = [j for j in judged if j.evidence > 0 and _worth_taking(base, j)]
    return Turn(base, tuple(screened), tuple(judged), plainest(worth))


def _wandering(turn: Turn) -> Fitted | None:
    """A fit that knows how its position drifts, where that alone explains what the round came to nothing with.

    What was taken without may have followed the drift: it is looked at again.
    """
    if turn.taken is not None and not turn.taken.fitted.is_off:
        return None
    known = with_wander_known(turn.base)
    return known if known is not turn.base else None


def _beside_pushes(turn: Turn, pace: Pace, barred: Names) -> Turn:
    """A round that takes what shows beside pushes that no log says; or the one that came to nothing without.

    As so many times the sensors' noise they hide it.
    """
    known = with_pushes_known(turn.base)
    if known is turn.base:
        return turn
    pace("beside what pushes the vessel")
    other = _turn(known, pace, barred)
    return other if other.taken else turn


def _in_waves(fitted: Fitted, turn: Turn) -> Fitted | None:
    """A fit that knows of waves, where they show and what swings by itself was taken without coming to the noise.

    Over short windows first states and hardly any damping let a roll follow whatever waves there are.
    """
    taken = turn.taken
    if taken is None or fitted.problem.swell is not None:
        return None
    if not swings(taken.fitted.solution.structure) or not taken.fitted.is_off:
        return None
    known = with_waves_known(fitted)
    return known if known.problem.swell is not None else None


def _swinging(fitted: Fitted, pace: Pace, barred: Names) -> tuple[Turn, Fitted] | None:
    """One round without the waves that a fit knows of, for what swings by itself, and the fit with it.

    None where nothing is taken, or waves are seen with it all the same.

    What hardly damps answers every manoeuvre at its own frequency, which looks like waves that the windows' first
    states and the waves then leave nothing of.
    """
    pace("what may swing as waves do")
    others = {a.effect.name for a in candidates(fitted.solution.structure) if not a.effect.fixed_terms}
    turn = _turn(without_waves(fitted), pace, barred | others)
    if turn.taken is None or not turn.taken.fitted.chi2_per_dof < FAR:
        return None
    after = _after(turn.taken)
    return (turn, after) if after.problem.swell is None else None


def _worth_taking(base: Fitted, judged: Judged) -> bool:
    return worthwhile(base, judged.fitted) or beyond_doubt(base, judged)


def _after(taken: Judged, waves: bool = True) -> Fitted:
    """The fit with an effect that was taken, at its best; with the ``waves`` known that it shows."""
    here = settled(taken.fitted)
    fitted = at_likeliest_size(in_likeliest_form(here))
    if fitted is not here:  # what was hidden in the wrong form is no noise
        fitted = under(recalibrated(fitted.problem, fitted.solution), fitted, 20)
    fitted = on_each_input(fitted)
    fitted = at_likeliest_speed(fitted) if taken.screened.active.effect.air else fitted
    return with_wander_anew(with_pushes_anew(with_waves_known(fitted) if waves else fitted))


def _together(turn: Turn, pace: Pace, barred: Names) -> list[Turn]:
    """Two rounds that take a pair which explains clearly more than what the round took; none where there is no such."""
    base = turn.base
    if len(base.solution.structure.actives) + 2 > MOST_EFFECTS:
        return []
    actives = [a for a in candidates(base.solution.structure) if a.effect.name not in barred]
    pair = best_pair(base, turn.taken, actives, pace)
    if pair is None:
        return []
    one, both = pair
    return [replace(turn, taken=one), Turn(one.fitted, turn.screened, (both,), both)]


def _in_pairs(turn: Turn, pace: Pace, barred: Names = NONE) -> list[Turn]:
    """Far from the noise, two rounds that together come near it where neither effect does alone; else the one round.

    Where two effects are missing, each refit alone bends everything to make up for the other.
    """
    if len(turn.base.solution.structure.actives) + 2 > MOST_EFFECTS:
        return [turn]
    if turn.base.chi2_per_dof < FAR:
        return _only_together(turn, pace, barred)
    nearest = sorted(turn.judged, key=lambda j: j.fitted.chi2_per_dof)[:FIRST_OF_PAIRS]
    for one in nearest:
        if at_bound(one.fitted) or one.fitted.chi2_per_dof > PROMISING * turn.base.chi2_per_dof:
            continue
        pace(f"with {one.label}, another")
        other = _turn(settled(one.fitted), pace, barred)
        near = [
            j
            for j in other.judged
            if j.fitted.chi2_per_dof < FAR and j.evidence > 0 and not at_bound(j.fitted)
        ]
        if near:
            second = min(near, key=lambda j: j.fitted.chi2_per_dof)
            return [replace(turn, taken=one), replace(other, taken=second)]
    return [turn]


def _only_together(turn: Turn, pace: Pace, barred: Names) -> list[Turn]:
    """Near the noise, two rounds that are worth naming together where the first is sure and yet not; else the one.

    A compass that is off, and late besides: each alone is measured beyond doubt, and predicts no better. A rich model
    may run away with an effect as it did without, until it is begun anew with it: then the first is worth it alone.
    """
    sure = [
        j for j in turn.judged if j.p_value < SURELY and j.evidence > 0 and consistent(turn.base, j.fitted)
    ]
    if not sure or at_bound(sure[0].fitted):
        return [turn]
    first = settled(sure[0].fitted)
    if first.chi2_per_dof < NEAR <= turn.base.chi2_per_dof and worthwhile(turn.base, first):
        return [replace(turn, taken=replace(sure[0], fitted=first))]
    pace(f"with {sure[0].label}, another")
    other = _turn(first, pace, barred)
    if other.taken is None or not worthwhile(turn.base, under(turn.base.problem, other.taken.fitted)):
        return [turn]
    return [replace(turn, taken=sure[0]), other]
