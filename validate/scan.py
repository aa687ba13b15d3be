"""Values of an effect between a log and the motion, looked at one by one through the accelerations.

The prediction error has narrow valleys where an actuator does something else than its log: all coefficients must
follow. A regression of the accelerations finds them at once for each value, so that a whole range can be looked at.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.signal import find_peaks

from identify.drive import drives
from identify.effect import Active, Parameter
from identify.regression import predicted, solve_regression
from identify.stretch import Stretch
from identify.structure import Structure
from validate.motion_seen import Motion, Wanted
from validate.swing_scan import swings, wanted_swings

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: The range looked at reaches from the least start divided by this to the largest times this, in so many steps.
BEYOND, STEPS = 3.0, 16
#: ... and for a sensor or a clock, which may be far off, to its typical size times this.
FAR_BEYOND = 30.0
#: A velocity of the air or the water is looked at in so many directions, and at these multiples of what is usual, or of
#: a component's typical size where nothing is.
DIRECTIONS = 12
USUAL, UNUSUAL = np.array([0.4, 0.8, 1.6]), np.array([1.0, 2.0, 4.0, 8.0])
#: A load is looked at from so much more to so much more, in so many steps; and as much less.
LOADS = np.geomspace(1.1, 3.0, 8)
#: A value is worth a fit of its own where the regression's misfit falls by this much (log, channels added): a
#: dead band that few samples pass gains hardly more.
WORTH = 0.02
#: ... and is clearly wanted where it falls by this much.
MUCH = 0.1


def best_value(
    structure: Structure, stretches: Sequence[Stretch], p: FloatArray, index: int = -1
) -> FloatArray | None:
    """Parameters (np,) with an effect's own where the accelerations want them, the others as in ``p``.

    None where there is nothing to look at, or where no value is clearly better than none.
    """
    gain, best = gain_and_value(structure, stretches, p, index)
    return best if gain > WORTH else None


def gain_and_value(
    structure: Structure, stretches: Sequence[Stretch], p: FloatArray, index: int = -1
) -> Wanted:
    """What the regression's misfit falls by with an effect's parameters at their best, and there; or nothing."""
    return next(iter(wanted_values(structure, stretches, p, index)), (0.0, p))


def wanted_values(
    structure: Structure, stretches: Sequence[Stretch], p: FloatArray, index: int = -1
) -> list[Wanted]:
    """What the regression's misfit falls by (log, channels added) in every valley of an effect's parameters, and there.

    The best first. There is none where an effect has nothing to look at, or several parameters that are neither a
    velocity of the water or the air, of which the best alone is told, nor those of a swing.
    """
    if swings(structure, index):
        return wanted_swings(structure, stretches, p, index)
    which = range(len(structure.actives))[index]
    mine = [k for k, s in enumerate(structure.slots) if s.effect == which and s.coefficient < 0]
    parameters = [structure.slots[k].parameter for k in mine]
    values = _values(structure.actives[which], parameters)
    if not len(values):
        return []
    others = np.where([s.coefficient < 0 for s in structure.slots], p, 0.0)
    motion, found, most = Motion(structure, stretches), [], None
    for value in ([x.null for x in parameters], *values):
        q = others.copy()
        q[mine] = [np.clip(v, *x.bounds) for v, x in zip(value, parameters, strict=True)]
        misfit, size = _misfit(structure, q, stretches, motion, most)
        most = size if most is None else most  # that of nothing, which comes first
        found.append((misfit, q))
    null, misfits = found[0][0], np.array([m for m, _ in found[1:]])
    lowest = _valleys(misfits) if len(mine) == 1 else [int(np.argmin(misfits))]
    return [(null - found[1 + k][0], found[1 + k][1]) for k in lowest]


def misfit_with(structure: Structure, stretches: Sequence[Stretch], p: FloatArray) -> float:
    """The regression's misfit (log, channels added) with every coefficient free, all else as in ``p``."""
    others = np.where([s.coefficient < 0 for s in structure.slots], p, 0.0)
    return _misfit(structure, others, stretches, Motion(structure, stretches))[0]


def _valleys(misfits: FloatArray) -> list[int]:
    """Places of the valleys along one parameter, the lowest first: the way to a lower one goes up by what is worth it.

    What reaches to both sides of nothing is one row.
    """
    padded = np.concatenate([[np.inf], misfits, [np.inf]])
    deep, _ = find_peaks(-np.minimum(padded, misfits.max() + 2.0 * WORTH), prominence=WORTH)
    return sorted((int(k) - 1 for k in deep), key=lambda k: misfits[k]) or [int(np.argmin(misfits))]


def _values(active: Active, parameters: Sequence[Parameter]) -> FloatArray:
    """Values (k, parameters) to look at."""
    if len(parameters) == 2 and (active.effect.air or active.effect.current):
        return _velocities(parameters[0])
    return _range_of(active, parameters[0])[:, None] if len(parameters) == 1 else np.zeros((0, 0))


def _velocities(component: Parameter) -> FloatArray:
    """Velocities (k, 2) in every direction: about what is sailed in, or from a component's typical size on."""
    usual = math.isfinite(component.known)
    sizes = component.known * USUAL if usual else component.scale * UNUSUAL
    along = np.arange(DIRECTIONS) * 2.0 * np.pi / DIRECTIONS
    around = np.column_stack([np.cos(along), np.sin(along)])
    return np.asarray((sizes[:, None, None] * around).reshape(-1, 2), dtype=float)


def between_log_and_hull(active: Active) -> bool:
    """Whether an effect acts on what an input makes of its log."""
    return bool(active.effect.actuator or active.effect.input_delay or active.effect.gain)


def _range_of(active: Active, parameter: Parameter) -> FloatArray:
    """Values to look at; none where an effect has no place between the motion and a log."""
    if active.effect.sensor and parameter.null == 0.0:
        return _both_ways(np.geomspace(parameter.scale / BEYOND, parameter.scale * FAR_BEYOND, STEPS))
    if active.effect.loading:
        loads = parameter.null * np.append(1.0 / LOADS[::-1], LOADS)
        return loads[(loads > parameter.bounds[0]) & (loads < parameter.bounds[1])]
    if not between_log_and_hull(active):
        return np.zeros(0)
    starts = parameter.starts
    if not starts and parameter.null == 0.0 and (parameter.relative or active.effect.gain):
        starts = (-parameter.scale, parameter.scale)
    if not starts:
        return np.zeros(0)
    size = np.abs(np.array(starts))
    up = np.geomspace(size.min() / BEYOND, size.max() * BEYOND, STEPS)
    return _both_ways(up) if min(starts) < 0 < max(starts) else up


def _both_ways(up: FloatArray) -> FloatArray:
    return np.concatenate([-up[::-1], up])


def _misfit(
    structure: Structure,
    p: FloatArray,
    stretches: Sequence[Stretch],
    motion: Motion,
    most: FloatArray | None = None,
) -> tuple[float, FloatArray]:
    """Log of the regression's squared errors over the accelerations' variance, channels added; and that variance (3,).

    It counts for no more than ``most`` (3,): a clock that is put wrong makes large accelerations of a turn, which any
    model explains.
    """
    driven = drives(structure, p, stretches)
    seen, designs = motion.by(driven), motion.designs(driven)
    fit = solve_regression(structure, p, designs.fine, seen.fine)
    size = seen.size if most is None else np.minimum(seen.size, most)
    square = np.mean((seen.slow - predicted(structure, fit, designs.slow)) ** 2, axis=0) / size
    return float(np.sum(np.log(square + 1e-6))), size
