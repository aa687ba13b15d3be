"""Which candidates a round refits: the most promising, or of a fit that is astray the best of every effect and form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from identify.fitted import FAR, NEAR, Fitted
from identify.free_running import FOLLOWS, free_running_misfit, is_lost
from identify.structure import Structure
from preprocess.cores import side_by_side
from validate.candidates import Screened
from validate.motion_seen import Wanted
from validate.refits import converges
from validate.scan import MUCH, WORTH, gain_and_value, misfit_with
from validate.swing_scan import swings

#: Candidates that are refitted in each round.
FINALISTS = 8
#: Off the noise so many are refitted besides that promise little, if the accelerations clearly want them.
WANTED = 2
#: At so many inputs one effect is looked at through the accelerations, which do not tell gains apart that are so near.
MOST_INPUTS, ALIKE = 6, 0.05
#: ... and so many are tried where these do not tell them apart.
UNDECIDED = 2
#: Those lead that the accelerations want more than so much of what they want most.
HALF = 0.5


def finalists(fitted: Fitted, screened: list[Screened], thorough: bool) -> list[Screened]:
    """The most promising; where a first order tells little, the best of every effect and form.

    Off the noise also what the accelerations want most of the others: where what was taken makes up for them, no step
    from there shows what they are worth. Near it those of which they want a value begin there too: a rich model that
    makes up for a slow rudder, or for a compass that is off, is far from the one that has it; and where slow errors say
    that it is off all the same, what is wanted most of the others as well.
    """
    if not (thorough or astray(fitted)):
        first = [s for s in screened[:FINALISTS] if s.gain > 8.0]
        wanted = _wanted(fitted, screened[len(first) :]) if fitted.is_off else []
        if fitted.chi2_per_dof > NEAR:
            return _leading(fitted, [*first, *wanted])
        asked = [s if _gain(s) > WORTH else replace(s, wanted=None) for s in _asked(fitted, first)]
        return [*asked, *wanted]
    kinds = {i.name: i.kind for i in fitted.solution.structure.inputs}
    forms: dict[tuple[str, str, str], list[Screened]] = {}
    for candidate in screened:
        forms.setdefault(_form(candidate, kinds), []).append(candidate)
    causes = [s.active for s in screened]
    likely = side_by_side(lambda alike: _likely(fitted, alike), list(forms.values()), shared=causes)
    return _leading(fitted, [s for alike in likely for s in alike])


def _leading(fitted: Fitted, chosen: list[Screened]) -> list[Screened]:
    """Of those that no refit may reach from where the fit is, which the accelerations want most, and clearly.

    Far from the noise, where many may run away, or lost, these are few, and none that swings by itself: that follows,
    once fitted, whatever is missing. There one that pushes by coefficients alone leads beside them: a base that is bent
    to do without it may be farther from it than any step goes.
    """
    if converges(fitted) or not chosen:
        return chosen
    asked = _asked(fitted, chosen)
    far = not fitted.chi2_per_dof < FAR or is_lost(fitted)
    gains = [0.0 if far and _swings(fitted, s) else _gain(s) for s in asked]
    most = sorted(gains, reverse=True)
    least = max(MUCH, HALF * most[0], *(most[WANTED : WANTED + 1] if far else ()))
    pushes = _pushing(fitted, asked) if far else None
    return [replace(s, leads=gain > least or s is pushes) for s, gain in zip(asked, gains, strict=True)]


def _pushing(fitted: Fitted, screened: Sequence[Screened]) -> Screened | None:
    """Of those with coefficients alone the one that takes most off the accelerations' misfit, if it is much."""
    structure, stretches = fitted.solution.structure, fitted.problem.stretches
    wide = {id(s): structure.with_effect(s.active) for s in screened}
    some = [s for s in screened if _coefficients_alone(wide[id(s)])]
    if not some:
        return None
    bare = misfit_with(structure, stretches, fitted.solution.p)
    left = side_by_side(lambda s: misfit_with(wide[id(s)], stretches, s.unmoved), some)
    best = min(range(len(some)), key=lambda k: left[k])
    return some[best] if bare - left[best] > MUCH else None


def _coefficients_alone(structure: Structure) -> bool:
    """Whether the last effect has nothing but coefficients of forces."""
    mine = [s for s in structure.slots if s.effect == len(structure.actives) - 1]
    return bool(mine) and all(s.coefficient >= 0 for s in mine)


def _swings(fitted: Fitted, screened: Screened) -> bool:
    return swings(fitted.solution.structure.with_effect(screened.active))


def _wanted(fitted: Fitted, others: Sequence[Screened]) -> list[Screened]:
    """Those that the accelerations want most, if clearly."""
    clearly = [s for s in _asked(fitted, others) if _gain(s) > MUCH]
    return sorted(clearly, key=_gain, reverse=True)[:WANTED]


def _asked(fitted: Fitted, screened: Sequence[Screened]) -> list[Screened]:
    """Candidates with what the accelerations gain by them, and where."""
    structure, stretches = fitted.solution.structure, fitted.problem.stretches

    def wanted(s: Screened) -> Wanted:
        return s.wanted or gain_and_value(structure.with_effect(s.active), stretches, s.unmoved)

    return [replace(s, wanted=w) for s, w in zip(screened, side_by_side(wanted, screened), strict=True)]


def _gain(screened: Screened) -> float:
    """What the accelerations gain by a candidate that they were asked about, if anything."""
    return max(0.0, screened.wanted[0]) if screened.wanted else 0.0


def _likely(fitted: Fitted, alike: Sequence[Screened]) -> Sequence[Screened]:
    """Of one effect at many like inputs that which the accelerations want most; where they do not tell, the first two.

    What moves the vessel ahead has most of the accelerations: it would always be preferred to what turns it.
    """
    if len(alike) <= UNDECIDED:
        return alike
    asked = _asked(fitted, alike[:MOST_INPUTS])
    most = max(map(_gain, asked))
    return [s for s in asked if _gain(s) >= most - ALIKE][:UNDECIDED]


def astray(fitted: Fitted) -> bool:
    """Whether a fit is far from the noise, or off it and unable to follow its own logs, or lost: in a wrong valley."""
    chi2 = fitted.chi2_per_dof
    return chi2 > FAR or (chi2 > NEAR and fitted.remembered(free_running_misfit) > FOLLOWS) or is_lost(fitted)


def _form(candidate: Screened, kinds: Mapping[str, str]) -> tuple[str, str, str]:
    """Effect and form and the kind of its input, whichever that is and whichever the logs."""
    variant = candidate.active.variant
    options = {k: v for k, v in variant.options.items() if k != "logs"}
    return candidate.active.effect.name, str(options), kinds.get(variant.input or "", "")
