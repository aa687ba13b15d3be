"""Waves that were found, known to the fits that go on from there: what is left shows what else is missing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identify.base_fit import fit_from_scratch, fit_states, tried, window_length
from identify.fitted import FAR, NEAR, Fitted
from identify.stretch import Stretch
from identify.structure import effects_alone
from identify.swell import Swell
from identify.windows import Problem, cut
from preprocess.cores import side_by_side
from validate.peaks import ENOUGH_CYCLES, LEAST_CYCLES
from validate.refits import knowing
from validate.waves import hardly_seen, perhaps_waves, waves_of

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Shares of a resonance's skirt that are tried, and how many times as wide a band as was seen ...
SKIRTS, WIDTHS = (0.0, 0.03, 0.1, 0.3, 1.0, 3.0), (0.5, 1.0, 2.0, 4.0)
#: ... in about so many windows.
ASKED = 12
#: Waves that errors only may show leave no more than this share of them.
LEFT = 0.1
#: Waves that a fit far from the noise shows are seen anew in a valley that leaves this share of its squared errors.
HALF = 0.5
#: Slow waves show in windows so many times as long as others.
LONGER = 2.0


def with_waves_known(fitted: Fitted) -> Fitted:
    """The fit refitted with the waves that its errors show, and what they leave open, known; without any as it was.

    Where it knew of waves that are not there any more, without these; those that alone keep it at the noise are there.
    Waves that its errors only may show are known from then on if with them it comes to the noise, or nearly.
    """
    known = fitted.problem.swell
    if known is None and fitted.chi2_per_dof < NEAR:
        return fitted
    usual = _in_usual_windows(fitted)
    swell = _shown(usual)
    if swell is None and known is None:
        tried = _tried(usual)
        return _from_where_it_led(fitted, tried) if tried else fitted
    if swell is None and not _would_show(known, usual):
        return fitted
    problem = _with_likeliest_shape(usual, swell)
    if _band(problem.swell) == _band(known):
        return fitted
    found = knowing(usual, problem)
    if swell is None and found.is_off and not fitted.is_off:
        return fitted
    return found if known else _from_where_it_led(fitted, found)


def _from_where_it_led(fitted: Fitted, found: Fitted) -> Fitted:
    """A fit with the waves that one without showed; or the like from that which it led to, where the first was far off.

    A fit that ran away has errors in which anything may swing; waves that they are taken for let it come back, and
    hide what is missing besides.
    """
    bare = without_waves(found) if fitted.is_far else fitted
    nearer = bare.chi2_per_dof < HALF * fitted.chi2_per_dof
    return with_waves_known(bare) if nearer else _seen_again(found)


def _seen_again(found: Fitted) -> Fitted:
    """A fit that knows of waves, seen anew where longer windows say more of their band, or where it had run away.

    What a fit in a wrong valley leaves is taken for a wide band, which then leaves nothing to be seen: one that is
    begun from scratch in these waves shows how wide they are.
    """
    if not found.problem.swell:
        return found
    if hardly_seen(found.problem.swell):
        found = with_waves_known(found)
    if not found.runs_away:
        return found
    begun = tried(partial(_begun_anew, found))
    return found if begun is None else with_waves_known(begun)


def _begun_anew(found: Fitted) -> Fitted:
    """A fit from scratch in the waves that a fit knows of, with its effects' values."""
    structure, problem = found.solution.structure, found.problem
    known = effects_alone(structure, found.solution.p)
    return fit_from_scratch(structure, problem.stretches, known, length=problem.length)


def _tried(fitted: Fitted) -> Fitted | None:
    """The fit with waves that its errors may show, if it comes to the noise with them, or by far the most of the way.

    Near it at least: far off, waves may stand for anything that swings, and hide it. What the inputs hide between their
    samples may have been taken for them.
    """
    bare = _bare(fitted)
    perhaps = _perhaps(bare)
    if perhaps is None:
        return None
    found = knowing(bare, _with_likeliest_shape(bare, perhaps))
    return found if found.chi2_per_dof < max(NEAR, min(FAR, LEFT * fitted.chi2_per_dof)) else None


def _bare(fitted: Fitted) -> Fitted:
    """The fit with nothing hidden but a wind's gusts."""
    return replace(fitted, problem=_in_gusts_alone(fitted.problem))


def _perhaps(fitted: Fitted) -> Swell | None:
    """Waves that a fit's errors may show, as sharp as windows of more cycles do; slow ones show in no others."""
    found = perhaps_waves(fitted)
    needed = _lasting(found) if found else LONGER * fitted.problem.length
    if needed <= fitted.problem.length:
        return found
    return perhaps_waves(_in_windows(fitted, needed)) or found


def _lasting(swell: Swell) -> float:
    """How long windows are in which waves show, s."""
    return ENOUGH_CYCLES * 2.0 * math.pi / swell.frequency


def seen_waves(fitted: Fitted) -> Swell | None:
    """Waves that a fit's errors show in windows that are long enough for those that it knows of.

    Where it is off the noise without these, they may show in windows that are longer still: a band as wide as the lines
    of short ones hardly stands out in them.
    """
    usual, known = _in_usual_windows(fitted), fitted.problem.swell
    found = _shown(usual)
    if found is not None or known is None or not without_waves(fitted).is_off:
        return found
    return waves_of(_in_windows(usual, LONGER * _lasting(known)))


def _in_gusts_alone(problem: Problem) -> Problem:
    """The problem with nothing hidden but a wind's gusts, which would else be taken for waves."""
    return replace(problem, unlogged=problem.unlogged and problem.unlogged.gusts_alone)


def without_waves(fitted: Fitted) -> Fitted:
    """The fit refitted without waves, where it knows of any."""
    problem = fitted.problem
    if problem.swell is None:
        return fitted
    return knowing(fitted, replace(problem, stretches=in_swell(problem.stretches, None)))


def needs_waves(fitted: Fitted) -> bool:
    """Whether a fit that knows of waves leaves the noise without them, or its errors then may show them.

    What was missing when they were first seen may have made their peak.
    """
    bare = without_waves(fitted)
    return bare is fitted or bare.is_off or perhaps_waves(bare) is not None


def _band(swell: Swell | None) -> tuple[object, ...] | None:
    """What of waves counts in a fit, but for how soon pushes are forgotten."""
    return (swell.frequency, swell.spread, swell.motion, swell.skirt) if swell else None


def _in_usual_windows(fitted: Fitted) -> Fitted:
    """The same parameters in windows of the usual length at least."""
    return _in_windows(fitted, window_length(fitted.solution.structure.vessel.length))


def _shown(fitted: Fitted) -> Swell | None:
    """Waves in a fit's own windows, or in those of enough cycles of the waves that it knows of."""
    known = fitted.problem.swell
    return waves_of(_in_windows(fitted, _lasting(known)) if known else fitted)


def _in_windows(fitted: Fitted, length: float) -> Fitted:
    """The same parameters in windows of a length, where the fit's are shorter and these do not run away."""
    if fitted.problem.length >= length:
        return fitted
    problem = _in_gusts_alone(cut(fitted.problem.stretches, length).weighted_as(fitted.problem))
    solution = fit_states(problem, fitted.solution.structure, fitted.solution.p)
    found = replace(fitted, problem=problem, solution=solution)
    return found if np.isfinite(found.solution.cost) else fitted


def _would_show(known: Swell | None, fitted: Fitted) -> bool:
    """Whether a fit near the noise has windows long enough for waves to show in."""
    if known is None or fitted.chi2_per_dof > FAR:
        return False
    return fitted.problem.length * known.frequency > 2.0 * math.pi * (LEAST_CYCLES + 1.0)


def _with_likeliest_shape(fitted: Fitted, swell: Swell | None) -> Problem:
    """The fit's problem in waves whose band is as wide, and has as much of a skirt, as its errors are likeliest with.

    These are asked in some of the windows, all over the logs; how wide it is, where no waves were known before.
    """
    problem, stretches = fitted.problem, fitted.problem.stretches
    if swell is None:
        return replace(problem, stretches=in_swell(stretches, None))
    every = max(1, len(problem.windows) // ASKED)
    raw = [
        e * problem.inflation[problem.kinds(w)][:, None]
        for w, e in zip(problem.windows[::every], fitted.solution.moments.raw[::every], strict=True)
    ]
    bare = replace(problem, windows=problem.windows[::every], inflation=np.ones(4))
    bare = replace(bare, unlogged=bare.unlogged and bare.unlogged.over(bare))
    widths = WIDTHS if problem.swell is None else (1.0,)
    shapes = [replace(swell, spread=w * swell.spread, skirt=s) for w in widths for s in SKIRTS]
    gains = side_by_side(partial(_gain, bare, raw), shapes)
    return replace(problem, stretches=in_swell(stretches, shapes[int(np.argmax(gains))]))


def _gain(bare: Problem, errors: Sequence[FloatArray], swell: Swell) -> float:
    """What errors (m, 2) in every window gain in 2 log likelihood by waves, with what the inputs hide."""
    there = replace(bare, stretches=in_swell(bare.stretches, swell))
    white, total = there.whitening, 0.0
    for k, (w, raw) in enumerate(zip(there.windows, errors, strict=True)):
        error = there.less_known(w, raw)
        total += float(np.sum(raw**2) - np.sum(error**2)) - there.known[w.stretch].information(w.samples)
        total += white.gain(k, w.stretch, w.samples, error) if white else 0.0
    return total


def in_swell(stretches: Sequence[Stretch], swell: Swell | None) -> tuple[Stretch, ...]:
    """Stretches that know of waves."""
    return tuple(replace(s, swell=swell) for s in stretches)
