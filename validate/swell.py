"""Waves that were found, known to the fits that go on from there: what is left shows what else is missing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.base_fit import FAR, NEAR, Fitted, fit_states, window_length
from identify.noise import calibrated_anew
from identify.stretch import Stretch
from identify.swell import Swell
from identify.windows import cut
from validate.peaks import LEAST_CYCLES
from validate.refits import under
from validate.waves import Waves, find_waves

#: A fit under new weights is refitted so many times.
ROUNDS = 3


def with_waves_known(fitted: Fitted) -> Fitted:
    """The fit refitted with the waves that its errors show, and what they leave open, known; without any as it was.

    Where it knew of waves that are not there any more, without these.
    """
    known = fitted.problem.stretches[0].swell
    if known is None and fitted.chi2_per_dof < NEAR:
        return fitted
    seen = _in_long_windows(fitted)
    swell = swell_of(find_waves(seen), fitted.solution.structure.vessel.antenna)
    if swell == known or (swell is None and not _would_show(known, seen)):
        return fitted
    problem = replace(seen.problem, stretches=in_swell(fitted.problem.stretches, swell))
    fitted = seen
    for _ in range(ROUNDS):
        fitted = under(problem, fitted, 20)
        problem = calibrated_anew(problem, fitted.solution)
    return under(problem, fitted, 20)


def _in_long_windows(fitted: Fitted) -> Fitted:
    """The same parameters in windows of the usual length, where the fit's are shorter and these do not run away."""
    structure, length = fitted.solution.structure, window_length(fitted.solution.structure.vessel.length)
    if fitted.problem.length >= length:
        return fitted
    problem = replace(cut(fitted.problem.stretches, length).weighted_as(fitted.problem), unlogged=None)
    found = replace(fitted, problem=problem, solution=fit_states(problem, structure, fitted.solution.p))
    return found if np.isfinite(found.solution.cost) else fitted


def _would_show(known: Swell | None, fitted: Fitted) -> bool:
    """Whether a fit near the noise has windows long enough for waves to show in."""
    if known is None or fitted.chi2_per_dof > FAR:
        return False
    return fitted.problem.length * known.frequency > 2.0 * math.pi * (LEAST_CYCLES + 1.0)


def swell_of(waves: Waves | None, antenna: tuple[float, float]) -> Swell | None:
    """What waves are to a fit."""
    if waves is None:
        return None
    motion = tuple(waves.motion.get(c, 0.0) for c in ("u", "v", "r"))
    return Swell(waves.frequency, waves.spread, (motion[0], motion[1], motion[2]), antenna)


def in_swell(stretches: Sequence[Stretch], swell: Swell | None) -> tuple[Stretch, ...]:
    """Stretches that know of waves."""
    return tuple(replace(s, swell=swell) for s in stretches)
