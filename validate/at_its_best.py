"""The fit after an effect was taken, at its best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.base_fit import fit_from_scratch
from identify.fitted import SLOWLY, Fitted
from identify.noise import recalibrated
from identify.ridge import with_likeliest_ridge
from identify.structure import effects_alone
from identify.taken_order import in_order_taken
from validate.on_its_way import on_its_way
from validate.refits import under
from validate.swapped_times import with_times_swapped


def settled(fitted: Fitted) -> Fitted:
    """The fit after an effect was taken, at its best, slow actuators as they began, and on their side of the hull."""
    return with_times_swapped(on_its_way(_settled(fitted)))


def _settled(fitted: Fitted) -> Fitted:
    """The fit at its best from where it is, or anew with the effects' values kept.

    What runs away under its own weights stays as it was, unless it comes nearer anew.
    """
    fitted, structure = in_order_taken(fitted), fitted.solution.structure
    here = under(recalibrated(fitted.problem, fitted.solution), fitted, 20)
    here = here if np.isfinite(here.solution.cost) else fitted
    p = effects_alone(structure, here.solution.p)
    off = here.is_off
    anew = fit_from_scratch(
        structure,
        fitted.problem.stretches,
        p,
        length=fitted.problem.length,
        rounds=2 if off else 0,
        apart=off or here.slow > SLOWLY,
    )
    hides = here.problem.unlogged is not None or anew.problem.unlogged is not None
    if hides and anew.problem.length >= here.problem.length:
        # with more believed to be hidden there is less to explain: as its own errors say
        weighed = under(recalibrated(anew.problem, anew.solution), anew, 20)
        if weighed.chi2_per_dof < here.chi2_per_dof:
            return with_likeliest_ridge(weighed)
    there = under(here.problem, replace(anew, prior=here.prior), 20)
    if not there.solution.total < here.solution.total:
        return with_likeliest_ridge(here)
    return with_likeliest_ridge(under(recalibrated(there.problem, there.solution), there))
