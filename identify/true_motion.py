"""The motion behind what the sensors show, as far as effects on sensors and clocks are known, and through the water."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]


@dataclass(frozen=True)
class GyroShown:
    """What the smoothed yaw rate has of a gyro's faults: its scale, its bias in rad/s, and how late it is in s."""

    scale: float
    bias: float
    late: float


def true_states(
    structure: Structure, sensor: FloatArray, stretch: Stretch, at: slice = slice(None)
) -> FloatArray:
    """States x, y, psi, u, v, r over ground (n, 6) behind the smoothed ones at some steps: sensors' effects off.

    A heading with a bias turns the velocities, an arm of the antenna adds to them, a late stream is read later.
    """
    seen = stretch.states
    if np.array_equal(sensor, [0.0, 0.0, 1.0, *structure.vessel.antenna, 0.0, 0.0, 0.0, 0.0]):
        return seen if at == slice(None) else seen[at]

    def later(column: FloatArray, clock: float) -> FloatArray:
        return _later(column, clock, stretch.h, at)

    clock, gyro = float(sensor[5]), gyro_shown(structure, sensor, stretch)
    psi = later(seen[:, 2], heading_clock(structure, sensor, stretch)) - sensor[0]
    rate = (later(seen[:, 5], gyro.late) - gyro.bias) / gyro.scale
    ground = later((seen[:, 3] + 1j * seen[:, 4]) * np.exp(1j * seen[:, 2]), clock)
    declared, arm = arms(structure, sensor, later(seen[:, 2], clock), psi)
    place = later(seen[:, 0] + 1j * seen[:, 1], clock) + declared - arm
    along = (ground + 1j * (later(seen[:, 5], clock) * declared - rate * arm)) * np.exp(-1j * psi)
    return np.column_stack([place.real, place.imag, psi, along.real, along.imag, rate])


def _later(column: FloatArray, clock: float, h: float, at: slice) -> FloatArray:
    """Part of a column (n,) as it is shown a time ``clock`` later."""
    if clock == 0.0:
        return column[at]
    t = h * np.arange(len(column))
    return np.asarray(np.interp(t[at] + clock, t, column))


def arms(
    structure: Structure, sensor: FloatArray, psi_shown: FloatArray, psi: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """From the origin to the antenna, north + i east (n,): where declared by the heading shown, and where it is."""
    bx, by = structure.vessel.antenna
    return (bx + 1j * by) * np.exp(1j * psi_shown), (sensor[3] + 1j * sensor[4]) * np.exp(1j * psi)


def gyro_shown(structure: Structure, sensor: FloatArray, stretch: Stretch) -> GyroShown:
    """The gyro's faults as far as they show in the smoothed yaw rate: not where that followed a compass.

    What that rate is late by is what it has of the clocks of both, beyond which the gyro's own word says more.
    """
    if "yaw_rate" not in structure.setting.streams:
        return GyroShown(1.0, 0.0, float(sensor[6]))
    size = float(np.std(stretch.states[:, 5]))
    line = stretch.gyro_line
    share = _share([(line.slope - 1.0) * size, line.offset], [(sensor[2] - 1.0) * size, float(sensor[1])])
    late = _between(float(sensor[7]) - line.late, sensor) if sensor[6:8].any() else 0.0
    return GyroShown(1.0 + share * (sensor[2] - 1.0), share * float(sensor[1]), late)


def _between(late: float, sensor: FloatArray) -> float:
    """A lateness, s, no further off than the clocks of heading and yaw rate are."""
    clocks = (0.0, float(sensor[6]), float(sensor[7]))
    return float(np.clip(late, min(clocks), max(clocks)))


def _share(beyond: Sequence[float], fault: Sequence[float]) -> float:
    """Share of a fault that the smoothed rate has, where the gyro itself is ``beyond`` that rate."""
    of = np.asarray(fault)
    followed = float(np.asarray(beyond) @ of) / max(float(of @ of), 1e-18)
    return float(np.clip(1.0 - followed, 0.0, 1.0))


def heading_clock(structure: Structure, sensor: FloatArray, stretch: Stretch) -> float:
    """By how much the heading that is shown is late, s: as the compass, but where the smoother followed a gyro."""
    if "yaw_rate" not in structure.setting.streams:
        return float(sensor[6])
    return _between(float(sensor[6]) - stretch.compass_line.late, sensor) if sensor[6:8].any() else 0.0


def through_water(states: FloatArray, current: FloatArray) -> FloatArray:
    """States (n, 6) over ground to states with u, v through the water."""
    out = states.copy()
    c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
    out[:, 3] -= current[0] * c + current[1] * s
    out[:, 4] -= -current[0] * s + current[1] * c
    return out


def over_ground(states: FloatArray, current: FloatArray) -> FloatArray:
    """States with u, v through the water to states (n, 6) over ground."""
    return through_water(states, -current)
