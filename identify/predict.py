"""Free-running prediction of what the sensors show, from the first state and the logged inputs alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify import kernel
from identify.drive import Drive, drive
from identify.regression import over_ground, through_water
from identify.stretch import Stretch
from identify.structure import Structure
from identify.true_motion import antenna_shift, gyro_shown, heading_clock, true_states

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Places of a stretch from which it is seen whether a model runs away.
BEGINNINGS = 8


def true_first_state(structure: Structure, d: Drive, stretch: Stretch, step: int = 0) -> FloatArray:
    """First state (8,) of the vessel from what the sensors show at a step: x, y, psi, u, v, r through the water."""
    state = true_states(structure, d.sensor, stretch, slice(step, step + 1))
    out = np.zeros(kernel.NX)
    out[:6] = through_water(state, d.current)[0]
    return out


def run(
    structure: Structure,
    d: Drive,
    stretch: Stretch,
    first: FloatArray,
    begin: int = 0,
    steps: int | None = None,
) -> FloatArray:
    """States (steps + 1, 8) of the vessel from ``first`` (8,) at grid point ``begin``; NaN after running away."""
    steps = stretch.steps - begin if steps is None else steps
    part = slice(begin, begin + steps)
    return kernel.free_run(
        structure.table.tape, first, stretch.h, structure.model.discrete, d.channels[part], d.slopes[part],
        d.wind[part], d.current, d.u0, d.coefficients,
    )  # fmt: skip


def accelerations_at(structure: Structure, d: Drive, state: FloatArray, step: int) -> FloatArray:
    """Accelerations (5,) of u, v, r, e1, e2 that the model gives in a state (8,), driven as a step begins."""
    channels = d.channels[step] - d.slopes[step]
    return kernel.accelerations_at(
        structure.table.tape, state, channels, d.wind[step], d.current, d.u0, d.coefficients
    )


def shown(structure: Structure, d: Drive, stretch: Stretch, states: FloatArray) -> FloatArray:
    """What the sensors show (n, 6) of the vessel's states (n, 8): sensor and clock effects put on.

    Velocities over ground are shown in the axes of the heading that is shown, as they are found from measurements.
    A heading that comes late does not show where a gyro tells the turning: the smoother follows the gyro.
    """
    out = over_ground(states[:, :6], d.current)
    psi, bias = states[:, 2], d.sensor[0]
    dx, dy = antenna_shift(structure, d.sensor, psi, psi + bias)
    arm_x, arm_y = d.sensor[3] - structure.vessel.antenna[0], d.sensor[4] - structure.vessel.antenna[1]
    u, v = out[:, 3] - out[:, 5] * arm_y, out[:, 4] + out[:, 5] * arm_x
    c, s = np.cos(psi), np.sin(psi)
    gyro = gyro_shown(structure, d.sensor, stretch)
    rate = gyro.scale * out[:, 5] + gyro.bias
    ground = np.column_stack([out[:, 0] + dx, out[:, 1] + dy, psi + bias, c * u - s * v, s * u + c * v, rate])
    clock = float(d.sensor[5])
    late = _late(
        ground, stretch.h, (clock, clock, heading_clock(structure, d.sensor), clock, clock, gyro.late)
    )
    c, s = np.cos(late[:, 2]), np.sin(late[:, 2])
    north, east = late[:, 3].copy(), late[:, 4].copy()
    late[:, 3], late[:, 4] = c * north + s * east, c * east - s * north
    return late


def _late(out: FloatArray, h: float, clocks: Sequence[float]) -> FloatArray:
    """Columns (n, 6), each shifted by its stream's clock offset; pose goes on in a straight line beyond the ends."""
    if not any(clocks):
        return out
    t = h * np.arange(len(out), dtype=np.float64)
    return np.column_stack(
        [
            _at(np.asarray(t - c), t, column, k < 3)
            for k, (c, column) in enumerate(zip(clocks, out.T, strict=True))
        ]
    )


def _at(when: FloatArray, t: FloatArray, column: FloatArray, pose: bool) -> FloatArray:
    """A column (n,) on the grid ``t`` at other times; that of a pose beyond the ends as it was there."""
    found = np.interp(when, t, column)
    if pose and len(t) > 1:
        for end, slope in ((0, column[1] - column[0]), (-1, column[-1] - column[-2])):
            beyond = when < t[0] if end == 0 else when > t[-1]
            found[beyond] += slope / (t[1] - t[0]) * (when[beyond] - t[end])
    return np.asarray(found, dtype=float)


def free_run(structure: Structure, p: FloatArray, stretch: Stretch) -> FloatArray:
    """Prediction (steps + 1, 6) of a whole stretch from its first smoothed state."""
    d = drive(structure, p, stretch)
    first = true_first_state(structure, d, stretch)
    with np.errstate(over="ignore", invalid="ignore"):
        return shown(structure, d, stretch, run(structure, d, stretch, first))


def relative_errors(
    structure: Structure, p: FloatArray, stretch: Stretch, spread: FloatArray, cap: float = 30.0
) -> FloatArray:
    """Free-running errors (steps + 1, 3) of u, v, r in units of their ``spread`` (3,), at most ``cap``.

    Zero for what the model does not predict.
    """
    error = (free_run(structure, p, stretch)[:, 3:6] - stretch.states[:, 3:6]) / spread
    predicted = np.array([name in structure.model.predicts for name in ("u", "v", "r")])
    error = np.clip(np.nan_to_num(error, nan=cap, posinf=cap, neginf=-cap), -cap, cap)
    return np.asarray(error * predicted, dtype=float)


def runs_away(structure: Structure, p: FloatArray, stretch: Stretch) -> bool:
    """Whether a free run to the stretch's end leaves all bounds, from its first smoothed state or from a later one.

    Coefficients that follow a log from one state may blow up from another that is a little off: many terms for few
    manoeuvres. So runs begin at ``BEGINNINGS`` places.
    """
    d = drive(structure, p, stretch)
    for begin in range(0, stretch.steps, max(1, -(-stretch.steps // BEGINNINGS))):
        first = true_first_state(structure, d, stretch, begin)
        if not np.isfinite(run(structure, d, stretch, first, begin)).all():
            return True
    return False
