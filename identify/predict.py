"""Free-running prediction of what the sensors show, from the first state and the logged inputs alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify import kernel
from identify.drive import Drive, drive
from identify.first_states import following_states
from identify.stretch import Stretch
from identify.structure import Structure
from identify.true_motion import arms, gyro_shown, heading_clock, over_ground, through_water, true_states

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Places of a stretch from which it is seen whether a model runs away.
BEGINNINGS = 8
#: Steps on either side of one over which its acceleration is taken.
AROUND = 5


def true_first_state(structure: Structure, d: Drive, stretch: Stretch, step: int = 0) -> FloatArray:
    """First state (8,) of the vessel from what the sensors show at a step: x, y, psi, u, v, r through the water.

    An effect's own states are where the smoothed motion has brought them: a run that begins in a turn begins heeled. A
    model's own is what the smoothed acceleration says of it.
    """
    state = true_states(structure, d.sensor, stretch, slice(step, step + 1))
    out = np.zeros(kernel.NX)
    out[:6] = through_water(state, d.current)[0]
    if structure.has_following_states:
        out[6:] = following_states(structure, d, stretch)[step]
    elif structure.model.extra:
        out[6] = _own_state(structure, d, stretch, out, step)
    return out


def _own_state(structure: Structure, d: Drive, stretch: Stretch, state: FloatArray, step: int) -> float:
    """The model's own state: what the equation that it drives lacks of the acceleration that the motion has there."""
    [(dof, _, by)] = structure.model.fixed
    column, part = "uvr".index(dof), slice(max(0, step - AROUND), step + AROUND + 1)
    seen = through_water(true_states(structure, d.sensor, stretch, part), d.current)[:, 3 + column]
    rate = float(np.polyfit(stretch.h * np.arange(len(seen), dtype=float), seen, 1)[0])
    return (rate - float(accelerations_at(structure, d, state, min(step, stretch.steps - 1))[column])) / by


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
    A heading or a gyro that comes late shows as far as the smoother followed it.
    """
    out = over_ground(states[:, :6], d.current)
    gyro, psi = gyro_shown(structure, d.sensor, stretch), out[:, 2]
    _, arm = arms(structure, d.sensor, psi, psi)
    place = out[:, 0] + 1j * out[:, 1] + arm
    ground = (out[:, 3] + 1j * out[:, 4]) * np.exp(1j * psi) + 1j * out[:, 5] * arm
    rate, clock = gyro.scale * out[:, 5] + gyro.bias, float(d.sensor[5])
    sensed = np.column_stack([place.real, place.imag, psi + d.sensor[0], ground.real, ground.imag, rate])
    clocks = (clock, clock, heading_clock(structure, d.sensor, stretch), clock, clock, gyro.late)
    late = _late(sensed, stretch.h, clocks)
    declared, _ = arms(structure, d.sensor, late[:, 2], psi)
    place = late[:, 0] + 1j * late[:, 1] - declared
    along = (late[:, 3] + 1j * late[:, 4] - 1j * late[:, 5] * declared) * np.exp(-1j * late[:, 2])
    return np.column_stack([place.real, place.imag, late[:, 2], along.real, along.imag, late[:, 5]])


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
