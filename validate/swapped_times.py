"""A slow actuator before a quick hull, and a quick one before a slow hull: the same motion but for what is small.

One first-order lag follows the other, and which of them is the actuator's shows only in how the hull's axes are coupled
and in how it answers at other speeds. A search from small lags ends with the wrong one if that is the smaller.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.base_fit import DECISIVE, short_windows, tried
from identify.drive import drive
from identify.effects.actuators import ACTUATOR_LAG
from identify.fitted import Fitted
from identify.noise import recalibrated
from identify.predict import accelerations_at
from identify.rough_fit import roughly
from identify.stretch import Stretch
from identify.structure import Structure, effects_alone
from validate.begins import with_begin
from validate.on_its_way import on_its_way
from validate.refits import begun_at, under

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Steps of velocities, m/s and rad/s, over which accelerations are differentiated.
STEP = 1e-4
#: Time constants that differ by less than this factor are one valley.
APART = 1.2
#: Steps of a fit that is begun elsewhere, and so many times one is.
FOLLOWED, SWAPS = 20, 3


def with_times_swapped(fitted: Fitted) -> Fitted:
    """The fit; or, where it is decidedly likelier, one in which a lag has changed places with the hull's own.

    Both are judged by the fit's weights. Far from the noise a lag stands for what it may, and is left as it is.
    """
    for _ in range(SWAPS):
        other = None if fitted.is_far else _likelier(fitted)
        if other is None:
            break
        fitted = other
    return fitted


def _likelier(fitted: Fitted) -> Fitted | None:
    """The nearest of the fits with a lag in the hull's place that are decidedly likelier, by weights of its own."""
    others = [_swapped(fitted, k, t) for k in _lags(fitted.solution.structure) for t in _times(fitted, k)]
    enough = fitted.solution.total - DECISIVE
    better = [f for f in others if f and under(fitted.problem, f, FOLLOWED).solution.total < enough]
    weighed = [under(recalibrated(f.problem, f.solution), f, FOLLOWED) for f in better]
    nearest = min((fitted, *weighed), key=lambda f: f.chi2_per_dof)
    return None if nearest is fitted else nearest


def _lags(structure: Structure) -> list[int]:
    """Places of the parameters that are an actuator's time constant."""
    own = [k for k, a in enumerate(structure.actives) if a.effect is ACTUATOR_LAG]
    return [k for k, s in enumerate(structure.slots) if s.effect in own]


def _times(fitted: Fitted, k: int) -> list[float]:
    """Time constants of the hull by a fit, s, that are possible for a lag and clearly not its own."""
    structure, own = fitted.solution.structure, fitted.solution.p[k]
    low, high = structure.slots[k].parameter.bounds
    times = hull_times(structure, fitted.solution.p, fitted.problem.stretches[0])
    return [t for t in times if low < t < high and max(t / own, own / t) > APART]


def _swapped(fitted: Fitted, k: int, time: float) -> Fitted | None:
    """The fit begun roughly with a lag as slow as the hull was, its actuator at rest as logs begin but where it was."""
    structure, problem = fitted.solution.structure, fitted.problem
    still = with_begin(structure, structure.slots[k].effect, {})
    bare = replace(fitted, solution=replace(fitted.solution, structure=still))
    p = np.where(np.arange(len(structure.slots)) == k, time, effects_alone(structure, fitted.solution.p))
    length = short_windows(problem, structure)
    return tried(lambda: on_its_way(begun_at(bare, roughly(still, problem.stretches, p, length), FOLLOWED)))


def hull_times(structure: Structure, p: FloatArray, stretch: Stretch) -> list[float]:
    """Time constants, s, with which small motions of the hull die away at a stretch's usual speed; the slow first.

    Motions that swing or grow have none.
    """
    driven, state = drive(structure, p, stretch), np.zeros(8)
    state[3] = float(np.median(stretch.states[:, 3]))
    step = int(np.argmin(np.abs(stretch.states[:-1, 5])))

    def at(column: int, by: float) -> FloatArray:
        moved = state.copy()
        moved[3 + column] += by
        return np.asarray(accelerations_at(structure, driven, moved, step)[:3])

    slopes = np.column_stack([(at(c, STEP) - at(c, -STEP)) / (2.0 * STEP) for c in range(3)])
    rates = np.linalg.eigvals(slopes)
    dying = rates[(np.abs(rates.imag) < STEP) & (rates.real < 0.0)].real
    return sorted((-1.0 / float(r) for r in dying), reverse=True)
