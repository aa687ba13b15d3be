"""The motion behind what the sensors show, as far as effects on sensors and clocks are known."""

from __future__ import annotations

import numpy as np

from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def true_states(structure: Structure, sensor: FloatArray, stretch: Stretch) -> FloatArray:
    """States x, y, psi, u, v, r over ground (steps + 1, 6) behind the smoothed ones: effects on sensors taken off.

    A heading with a bias turns the velocities, an arm of the antenna adds to them, a late stream is read later.
    """
    seen = stretch.states
    if np.array_equal(sensor, [0.0, 0.0, 1.0, *structure.vessel.antenna, 0.0, 0.0, 0.0, 0.0]):
        return seen
    clock, late = float(sensor[5]), heading_clock(structure, sensor)
    scale, offset = gyro_shown(structure, sensor, stretch)
    psi = _later(seen[:, 2], late, stretch.h) - sensor[0]
    rate = (_later(seen[:, 5], float(sensor[7]), stretch.h) - offset) / scale
    turn = np.exp(1j * seen[:, 2])
    ground = _later((seen[:, 3] + 1j * seen[:, 4]) * turn, clock, stretch.h)
    place = _later(seen[:, 0] + 1j * seen[:, 1], clock, stretch.h)
    x, y = antenna_shift(structure, sensor, psi, psi + sensor[0])
    along = ground * np.exp(-1j * psi)
    bx, by = structure.vessel.antenna
    u, v = along.real + rate * (sensor[4] - by), along.imag - rate * (sensor[3] - bx)
    return np.column_stack([place.real - x, place.imag - y, psi, u, v, rate])


def _later(column: FloatArray, clock: float, h: float) -> FloatArray:
    """A column (n,) as it is shown a time ``clock`` later."""
    if clock == 0.0:
        return column
    t = h * np.arange(len(column))
    return np.asarray(np.interp(t + clock, t, column))


def antenna_shift(
    structure: Structure, sensor: FloatArray, psi: FloatArray, psi_shown: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """How far the origin seems from where it is: true arm at the true heading, declared arm at the shown one."""
    ax, ay = sensor[3], sensor[4]
    bx, by = structure.vessel.antenna
    c, s, cb, sb = np.cos(psi), np.sin(psi), np.cos(psi_shown), np.sin(psi_shown)
    return c * ax - s * ay - (cb * bx - sb * by), s * ax + c * ay - (sb * bx + cb * by)


def gyro_shown(structure: Structure, sensor: FloatArray, stretch: Stretch) -> tuple[float, float]:
    """Scale and bias of the gyro as far as they show in the smoothed yaw rate: not where that followed a compass."""
    if "yaw_rate" not in structure.setting.streams:
        return 1.0, 0.0
    size = float(np.std(stretch.states[:, 5]))
    fault = np.array([(sensor[2] - 1.0) * size, sensor[1]])
    slope, offset = stretch.gyro_line
    followed = np.array([(slope - 1.0) * size, offset]) @ fault / max(float(fault @ fault), 1e-18)
    share = float(np.clip(1.0 - followed, 0.0, 1.0))
    return 1.0 + share * (sensor[2] - 1.0), share * sensor[1]


def heading_clock(structure: Structure, sensor: FloatArray) -> float:
    """By how much the heading that is shown is late, s."""
    return 0.0 if "yaw_rate" in structure.setting.streams else float(sensor[6])
