"""The speed that a model's terms in Δu are about, as the smoothed motion says it: where the search for it begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import find_peaks

from identify.regression import predicted, regressors, solve_regression
from identify.slopes import true_accelerations
from identify.stretch import Stretch
from identify.structure import Structure, null_parameters

#: Speeds tried, as shares of the guess; then on a finer grid about the best.
LOW, HIGH, TRIED = 0.7, 1.4, 29
#: A valley that leaves no more than so many times the least is as good: a polynomial in Δu has other zeros than this
#: one, far from what was sailed, and noise may make any of them the best.
AS_GOOD = 1.1
FINER = 11
#: Ridge of the regressions: terms in Δu are nearly collinear.
RIDGE = 1e-8


def with_speed_from_motion(structure: Structure, stretches: Sequence[Stretch]) -> Structure:
    """The structure whose ``u0`` leaves least of the surge accelerations, or as little and is nearer to the guess.

    As it is where that speed is no parameter.

    Terms in Δu and its powers vanish at u₀: it is the speed that the model holds by itself, and a wrong one leaves a
    constant times U that no coefficient can make up for.
    """
    if not structure.u0_is_free:
        return structure
    target = np.vstack([true_accelerations(structure, null_parameters(structure), s) for s in stretches])

    def left(speed: float) -> float:
        about = replace(structure, u0=speed, u0_found=False)
        p = null_parameters(about)
        design = np.vstack([regressors(about, p, s) for s in stretches])
        p = solve_regression(about, p, design, target, RIDGE)
        return float(np.sum((target - predicted(about, p, design))[:, 0] ** 2))

    guess = structure.u0
    speeds = guess * np.linspace(LOW, HIGH, TRIED)
    errors = np.array([left(u) for u in speeds])
    valleys, _ = find_peaks(-np.pad(errors, 1, constant_values=np.inf))
    as_good = speeds[[k - 1 for k in valleys if errors[k - 1] <= AS_GOOD * errors.min()]]
    best, step = as_good[int(np.argmin(np.abs(as_good - guess)))], speeds[1] - speeds[0]
    near = best + step * np.linspace(-1.0, 1.0, FINER)
    return replace(structure, u0=float(near[int(np.argmin([left(u) for u in near]))]))
