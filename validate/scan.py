"""Values of an effect between a log and the motion, looked at one by one through the accelerations.

The prediction error has narrow valleys where an actuator does something else than its log: all coefficients must
follow. A regression of the accelerations finds them at once for each value, so that a whole range can be looked at.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.effect import Active, Parameter
from identify.regression import predicted, regressors, solve_regression, true_accelerations
from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: The range looked at reaches from the least start divided by this to the largest times this, in so many steps.
BEYOND, STEPS = 3.0, 16
#: ... and for a sensor or a clock, which may be far off, to its typical size times this.
FAR_BEYOND = 30.0
#: Accelerations are slopes over this time either way, s.
SLOPE = 1.0
#: A value is worth a fit of its own where the regression's misfit falls by this much (log, channels added).
WORTH = 0.05


def best_value(
    structure: Structure, stretches: Sequence[Stretch], p: FloatArray, index: int = -1
) -> FloatArray | None:
    """Parameters (np,) with an effect's only parameter where the accelerations want it, the others as in ``p``.

    None where the effect has several parameters or none to look at, or where no value is clearly better than none.
    """
    gain, best = gain_and_value(structure, stretches, p, index)
    return best if gain > WORTH else None


def gain_and_value(
    structure: Structure, stretches: Sequence[Stretch], p: FloatArray, index: int = -1
) -> tuple[float, FloatArray]:
    """What the regression's misfit falls by (log, channels added) with an effect's parameter at its best, and there.

    Nothing, where the effect has several parameters or none to look at.
    """
    which = range(len(structure.actives))[index]
    active = structure.actives[which]
    mine = [k for k, s in enumerate(structure.slots) if s.effect == which]
    parameter = structure.slots[mine[0]].parameter if len(mine) == 1 else None
    if parameter is None or not len(values := _range_of(active, parameter)):
        return 0.0, p
    others = np.where([s.coefficient < 0 for s in structure.slots], p, 0.0)
    found = []
    for value in (parameter.null, *values):
        q = others.copy()
        q[mine[0]] = np.clip(value, *parameter.bounds)
        found.append((_misfit(structure, q, stretches), q))
    null, (least, best) = found[0][0], min(found[1:], key=lambda x: x[0])
    return null - least, best


def between_log_and_hull(active: Active) -> bool:
    """Whether an effect acts on what an input makes of its log."""
    return bool(active.effect.actuator or active.effect.input_delay or active.effect.gain)


def _range_of(active: Active, parameter: Parameter) -> FloatArray:
    """Values to look at; none where an effect has no place between the motion and a log."""
    if active.effect.sensor and parameter.null == 0.0:
        return _both_ways(np.geomspace(parameter.scale / BEYOND, parameter.scale * FAR_BEYOND, STEPS))
    if not between_log_and_hull(active):
        return np.zeros(0)
    starts = parameter.starts
    if not starts and parameter.relative and parameter.null == 0.0:
        starts = (-parameter.scale, parameter.scale)
    if not starts:
        return np.zeros(0)
    size = np.abs(np.array(starts))
    up = np.geomspace(size.min() / BEYOND, size.max() * BEYOND, STEPS)
    return _both_ways(up) if min(starts) < 0 < max(starts) else up


def _both_ways(up: FloatArray) -> FloatArray:
    return np.concatenate([-up, up])


def _misfit(structure: Structure, p: FloatArray, stretches: Sequence[Stretch]) -> float:
    """Log of the regression's squared errors over the accelerations' variance, channels added."""
    designs = [regressors(structure, p, s) for s in stretches]
    rates = [true_accelerations(structure, p, s) for s in stretches]
    q = solve_regression(structure, p, np.vstack(designs), np.vstack(rates))
    scales = [true_accelerations(structure, p, s, max(1, round(SLOPE / s.h))) for s in stretches]
    errors = [t - predicted(structure, q, d) for t, d in zip(scales, designs, strict=True)]
    square = np.mean(np.vstack(errors) ** 2, axis=0) / (np.var(np.vstack(scales), axis=0) + 1e-12)
    return float(np.sum(np.log(square + 1e-6)))
