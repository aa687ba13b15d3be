"""What of a drive is the same at all times: coefficients, the water's and the air's velocity, the sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identify.effect import Active, Effect, SensorShift
from identify.kernel import NM
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Values = Sequence[dict[str, float]]

_CLOCKS = {"position": 5, "heading": 6, "yaw_rate": 7, "velocity": 8}


class Steady(NamedTuple):
    """What is the same at all times in one log.

    ``coefficients`` (c,) with the ``factor`` (c,) that effects on loading put on them, velocities of the water, the
    ``current`` (2,), and of the ``air`` (2,) that no log has, parameters of the sensors ``sensor`` (9,).
    """

    coefficients: FloatArray
    factor: FloatArray
    current: FloatArray
    air: FloatArray
    sensor: FloatArray


@dataclass(frozen=True)
class SteadySlopes:
    """Derivatives of the same along each general parameter (ng of them): (ng, c), (2, ng), (2, ng), (9, ng)."""

    coefficients: FloatArray
    current: FloatArray
    air: FloatArray
    sensor: FloatArray


def values_of(structure: Structure, p: FloatArray) -> list[dict[str, float]]:
    """Named parameter values of every active effect."""
    return [structure.values(p, e) for e in range(len(structure.actives))]


def steady(structure: Structure, p: FloatArray, values: Values, log: str) -> Steady:
    """What effects make of coefficients, water, air and sensors in a log."""
    current = current_of(structure, p, values)
    air = np.zeros(2)
    for active, v in zip(structure.actives, values, strict=True):
        if active.effect.air:
            air += active.effect.air(v)
    factor = _loading(structure, values, log)
    coefficients = factor * _coefficients(structure, p, values)
    return Steady(coefficients, factor, current, air, sensor_of(structure, p, values))


def steady_slopes(structure: Structure, p: FloatArray, log: str) -> SteadySlopes:
    """Derivatives of what is the same at all times: by central differences of those effects that say anything of it."""
    general, layout = structure.general, structure.layout
    out = SteadySlopes(
        np.zeros((len(general), len(layout.given))), np.zeros((2, len(general))), np.zeros((2, len(general))),
        np.zeros((NM, len(general))),
    )  # fmt: skip
    clocks = {k: stream for stream, k in structure.clock_slots.items()}
    for g, k in enumerate(general):
        effect = structure.slots[k].effect
        if k in clocks:
            out.sensor[_CLOCKS[clocks[k]], g] = 1.0
        elif effect >= 0 and _says(structure.actives[effect].effect):
            ends = [moved(structure, p, int(k), sign) for sign in (1.0, -1.0)]
            up, down = (steady(structure, q, values_of(structure, q), log) for q in ends)
            width = ends[0][k] - ends[1][k]
            out.coefficients[g] = (up.coefficients - down.coefficients) / width
            out.current[:, g] = (up.current - down.current) / width
            out.air[:, g] = (up.air - down.air) / width
            out.sensor[:, g] = (up.sensor - down.sensor) / width
    return out


def moved(structure: Structure, p: FloatArray, k: int, sign: float) -> FloatArray:
    """``p`` with one parameter moved by a small part of its scale, within its bounds."""
    parameter = structure.slots[k].parameter
    (low, high), out = parameter.bounds, p.copy()
    out[k] = min(max(p[k] + sign * 0.02 * parameter.scale, low), high)
    return out


def loaded(structure: Structure, log: str) -> tuple[bool, ...]:
    """Which effects on loading are in a log: logs with the same ones have the same steady part."""
    return tuple(_loads(a, log) for a in structure.actives if a.effect.loading)


def _loads(active: Active, log: str) -> bool:
    logs = active.variant.options["logs"]
    return isinstance(logs, tuple) and log in logs


def _says(effect: Effect) -> bool:
    """Whether an effect says anything of coefficients, water, air or sensors."""
    return any((effect.current, effect.air, effect.sensor, effect.loading, effect.fixed_terms))


def _coefficients(structure: Structure, p: FloatArray, values: Values) -> FloatArray:
    layout = structure.layout
    out = layout.given.copy()
    out[layout.plain] = p[structure.simple]
    for active, v, k in zip(structure.actives, values, layout.fixed, strict=True):
        if active.effect.fixed_terms:
            given = active.effect.fixed_terms(v)
            out[k : k + len(given)] = [value for _, value in given]
    return out


def _loading(structure: Structure, values: Values, log: str) -> FloatArray:
    """Factor on each coefficient in this log, from effects on loading and depth."""
    layout = structure.layout
    factor = np.ones(len(layout.given))
    for active, v, own in zip(structure.actives, values, layout.free, strict=True):
        if active.effect.loading is None:
            continue
        if not _loads(active, log):
            factor[own] = 0.0
            continue
        factor *= layout.factors(active.effect.loading(v, active.variant.options))
    return factor


def current_of(structure: Structure, p: FloatArray, values: Values | None = None) -> FloatArray:
    """The water's velocity (2,), north and east, m/s: what effects make of it."""
    out = np.zeros(2)
    for active, v in zip(
        structure.actives, values_of(structure, p) if values is None else values, strict=True
    ):
        if active.effect.current:
            out += active.effect.current(v)
    return out


def sensor_of(structure: Structure, p: FloatArray, values: Values | None = None) -> FloatArray:
    """Parameters of the sensors (9,): what effects on sensors and clocks make of them."""
    if values is None:
        values = values_of(structure, p)
    out = np.zeros(NM)
    out[2] = 1.0
    out[3], out[4] = structure.vessel.antenna
    for stream, k in structure.clock_slots.items():
        out[_CLOCKS[stream]] = p[k]
    for active, v in zip(structure.actives, values, strict=True):
        if active.effect.sensor:
            _add(out, active.effect.sensor(v, active.variant.options), structure.setting.one_receiver)
    return out


def _add(out: FloatArray, shift: SensorShift, one_receiver: bool) -> None:
    out[0] += shift.heading_bias
    out[1] += shift.gyro_bias
    out[2] += shift.gyro_scale
    out[3] += shift.antenna[0]
    out[4] += shift.antenna[1]
    for stream, offset in shift.clock.items():
        out[_CLOCKS[stream]] += offset
    if one_receiver:
        out[_CLOCKS["velocity"]] += shift.clock.get("position", 0.0)
