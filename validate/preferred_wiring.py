"""Which wiring a search begins with: the declared one, the one that the accelerations prefer, or one that may be it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identify.base_fit import CLEARLY, fit_from_scratch, tried
from identify.fitted import FAR, NEAR, Fitted
from identify.prepare import Prepared
from validate.judgement import INDISTINCT
from validate.nearer import nearer_in_windows_alike
from validate.refits import under
from validate.wiring import Wiring, better_wiring, perhaps_wired

#: So many wirings that are not clearly better are fitted where a search with the declared one stays off the noise.
PERHAPS = 2


def preferred_wiring(prepared: Prepared, declared: Fitted | None) -> Wiring | None:
    """The wiring that the accelerations prefer; none where the free run prefers the declared one all the same."""
    wiring = better_wiring(prepared.structure, prepared.identify)
    if wiring is None or declared is None:
        return wiring
    structure = prepared.structure.with_effect(wiring.active)
    other = fit_from_scratch(structure, prepared.identify)
    if declared.chi2_per_dof < NEAR:
        bare = replace(declared.problem, unlogged=None)
        here, there = (under(bare, f, 20).solution.total for f in (declared, other))
        return wiring if there < here + INDISTINCT else None
    if declared.chi2_per_dof > FAR:  # where nothing fits, the accelerations have spoken
        return None if nearer_in_windows_alike(declared, other) else wiring
    if other.problem.length != declared.problem.length:
        return wiring if other.problem.length > declared.problem.length else None
    return wiring if other.chi2_per_dof < declared.chi2_per_dof else None


@dataclass(frozen=True)
class Otherwise:
    """The nearest of the wirings that the accelerations may prefer, in short windows; χ² with it, and as declared."""

    wiring: Wiring
    chi2: float
    declared: float


def wired_otherwise(prepared: Prepared, length: float) -> Otherwise | None:
    """What fits in windows of ``length`` s say of wirings that the accelerations would rather have, if any."""
    structure, stretches = prepared.structure, prepared.identify
    perhaps = perhaps_wired(structure, stretches, PERHAPS)
    if not perhaps:
        return None
    wired = (structure, *(structure.with_effect(w.active) for w in perhaps))
    fits = [tried(partial(fit_from_scratch, s, stretches, length=length)) for s in wired]
    declared, *chi2 = (np.inf if f is None else f.chi2_per_dof for f in fits)
    least = min(chi2)
    wiring = perhaps[chi2.index(least)]
    away = {w.active.label for w, x in zip(perhaps, chi2, strict=True) if CLEARLY * x > least}
    wiring = replace(wiring, look_alikes=tuple(a for a in wiring.look_alikes if a not in away))
    return Otherwise(wiring, least, declared)
