"""Accelerations as slopes of the smoothed motion, and what has the same average on the other side of the equation."""

from __future__ import annotations

from functools import cache

import numpy as np

from identify.resample import averaged_at
from identify.steady import current_of, sensor_of
from identify.stretch import Stretch, slopes_of
from identify.structure import Structure
from identify.true_motion import through_water, true_states

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Steps either way over which an acceleration is the slope.
SLOPE_STEPS = 5


def accelerations(
    stretch: Stretch,
    window: int = SLOPE_STEPS,
    states: FloatArray | None = None,
    current: FloatArray | None = None,
) -> FloatArray:
    """Rates (n, 3) of u, v, r at the middle of each step, over ``window`` steps either way (a least-squares slope).

    They are those of the smoothed states, or of ``states`` (n + 1, 6) in their place. Where a ``current`` (2,) flows
    they are those through the water, as the forces on the hull make them: over ground a vessel that turns in a current
    changes its velocity along its own axes without any force.
    """
    seen = stretch.states if states is None else states
    if current is not None and current.any():
        return slopes_of(through_water(seen, current), stretch.h, window)
    return stretch.slopes(window) if seen is stretch.states else slopes_of(seen, stretch.h, window)


def steps_of_slope(stretch: Stretch) -> int:
    """Steps either way over which an acceleration is the slope."""
    return max(1, min(SLOPE_STEPS, stretch.steps // 8))


def true_accelerations(
    structure: Structure, p: FloatArray, stretch: Stretch, window: int = SLOPE_STEPS
) -> FloatArray:
    """Rates (n, 3) of u, v, r through the water of the motion behind what the sensors show."""
    states = true_states(structure, sensor_of(structure, p), stretch)
    return accelerations(stretch, window, states, current_of(structure, p))


def averaged(rates: FloatArray, m: int, every: int = 1) -> FloatArray:
    """Rates (n, k) as ``accelerations`` over ``m`` steps either way see them, in every so manieth step.

    Beyond the ends there is nothing.

    A slope by least squares is an average of the rates in between; without the same average on the other side of the
    equation, whatever is quick would seem weaker than it is.
    """
    return np.asarray(averaged_at(np.ascontiguousarray(rates, dtype=float), slope_weights(m), every))


@cache
def slope_weights(m: int) -> FloatArray:
    """Weights (2 m + 1,) of the rates at the middles of steps in the mean of two neighbouring slopes over ± m steps."""
    k = np.arange(-m, m + 1)
    one = np.cumsum(k[::-1])[:-1] / np.sum(k * k)  # of the 2 m steps under one slope
    return np.asarray(0.5 * (np.append(one, 0.0) + np.append(0.0, one)), dtype=float)
