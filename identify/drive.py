"""What drives a stretch for given parameters: channels, coefficients, current, air and sensors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identify.effect import SensorShift
from identify.flow import PARAMETERS, channel_of
from identify.forces import THRUSTING, channels, thrust
from identify.kernel import CHANNEL, NM
from identify.resample import straight_lines
from identify.stretch import SUBSTEPS, Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

_CLOCKS = {"position": 5, "heading": 6, "yaw_rate": 7, "velocity": 8}


class Drive(NamedTuple):
    """Everything that the compiled rollout and the measurement equation need, beside the initial state.

    ``channels`` (n, nc) mean over each step and ``slopes`` (n, nc) of the straight line with the same first moment (end
    less middle), ``fine`` (n·SUBSTEPS, nc), ``coefficients`` (p,), ``wind`` (n, 2), ``current`` (2,), ``sensor`` (9,);
    ``factor`` (p,) is what effects on loading make of each coefficient in this log (already in ``coefficients``).
    """

    channels: FloatArray
    slopes: FloatArray
    fine: FloatArray
    coefficients: FloatArray
    wind: FloatArray
    current: FloatArray
    sensor: FloatArray
    factor: FloatArray


#: Where the air's velocity stands among the places that a parameter may move.
AIR = (12, 13)


@dataclass(frozen=True)
class Directions:
    """Derivatives of a drive along each general parameter (ng of them).

    ``coefficients`` (ng, p), ``current`` (2, ng), ``sensor`` (9, ng). Of channels, and of the air's velocity over the
    water, only what moves: ``driven`` (d, 2) places (``identify.kernel.CHANNEL`` on, or ``AIR``) and parameters,
    ``values`` (n, d) the derivatives at each step and ``slopes`` (n, d) those of the lines' slopes.
    """

    coefficients: FloatArray
    driven: IntArray
    values: FloatArray
    slopes: FloatArray
    current: FloatArray
    sensor: FloatArray


def drive(structure: Structure, p: FloatArray, stretch: Stretch, same_inputs: Drive | None = None) -> Drive:
    """Evaluate effects on inputs, water, air, loading and sensors for one stretch.

    ``same_inputs`` is a drive whose actuators are known to be the same, so that they need not be made again.
    """
    values = [structure.values(p, e) for e in range(len(structure.actives))]
    if same_inputs is None:
        actuators = actuators_of(structure, p, values, stretch)
        actuators |= {c: np.full(stretch.steps * SUBSTEPS, p[k]) for c, k in flow_channels(structure).items()}
        fine = channels(structure.table.channels, structure.inputs, actuators, stretch.steps * SUBSTEPS)
        mean, slope = straight_lines(fine, SUBSTEPS)
    else:
        mean, slope, fine = same_inputs[:3]
    current, air = np.zeros(2), np.zeros(2)
    for active, v in zip(structure.actives, values, strict=True):
        if active.effect.current:
            current = current + np.array(active.effect.current(v))
        if active.effect.air:
            air = air + np.array(active.effect.air(v))
    factor = _loading(structure, values, stretch.name)
    coefficients = factor * _coefficients(structure, p, values)
    return Drive(
        mean, slope, fine, coefficients, stretch.wind + air, current, sensor_of(structure, p, values), factor
    )


def flow_channels(structure: Structure) -> dict[str, int]:
    """Channels that carry the parameters of the flow behind the hull, and their slots."""
    names = {q.name for q in PARAMETERS} if structure.model.flow else set()
    return {channel_of(s.name): k for k, s in enumerate(structure.slots) if s.effect < 0 and s.name in names}


def actuators_of(
    structure: Structure, p: FloatArray, values: list[dict[str, float]], stretch: Stretch
) -> dict[str, FloatArray]:
    """Each input as the actuator made it, and ``"thrust NAME"`` with gains, on the fine grid (n·SUBSTEPS,)."""
    dt = stretch.h / SUBSTEPS
    begins = input_clocks(structure, p, stretch, values)
    acting = {n: stretch.acting(n, begin) for n, begin in begins.items()}
    series, switching = ({n: a[k] for n, a in acting.items()} for k in (0, 1))
    for active in structure.actives:
        if active.effect.rewire:
            series, switching = (active.effect.rewire(active.variant.options, x) for x in (series, switching))
    for active, v in zip(structure.actives, values, strict=True):
        name = active.variant.input
        if active.effect.actuator and name is not None:
            series[name] = active.effect.actuator(v, series[name], dt, active.options_in(stretch.name))
    time = stretch.campaign_time + dt * (np.arange(stretch.steps * SUBSTEPS, dtype=float) + 0.5)
    for item in structure.inputs:
        if item.kind in THRUSTING:
            force = thrust(item, series[item.name])
            if item.law != "linear":
                # Stays whatever acts on the input: an effect of no size must change nothing.
                force += switching[item.name]
            for active, v in zip(structure.actives, values, strict=True):
                if active.effect.gain and active.variant.input in (None, item.name):
                    force = force * active.effect.gain(v, time)
            series[f"thrust {item.name}"] = force
    return series


def input_clocks(
    structure: Structure, p: FloatArray, stretch: Stretch, values: list[dict[str, float]] | None = None
) -> dict[str, float]:
    """Time on each input's log, s, of what acts when a stretch begins."""
    if values is None:
        values = [structure.values(p, e) for e in range(len(structure.actives))]
    begin = stretch.start + _lead(structure, p)
    return {i.name: begin - _delay(structure, values, i.name) for i in structure.inputs}


def _lead(structure: Structure, p: FloatArray) -> float:
    """How far the actuators are ahead of the logged inputs, s; the expected lead where it is not a parameter."""
    for k, slot in enumerate(structure.slots):
        if slot.name == "input_lead" and slot.effect < 0:
            return float(p[k])
    return structure.input_lead[0] if structure.input_lead is not None else 0.0


def _delay(structure: Structure, values: list[dict[str, float]], name: str) -> float:
    return sum(
        active.effect.input_delay(v)
        for active, v in zip(structure.actives, values, strict=True)
        if active.effect.input_delay and active.variant.input in (None, name)
    )


def _coefficients(structure: Structure, p: FloatArray, values: list[dict[str, float]]) -> FloatArray:
    out = np.zeros(len(structure.table.terms))
    for k, slot in enumerate(structure.slots):
        if slot.coefficient >= 0:
            out[slot.coefficient] = p[k]
    k = len(structure.setting.terms)
    for _, _, value in structure.model.fixed:
        out[k] = value
        k += 1
    for active, v in zip(structure.actives, values, strict=True):
        k += len(active.effect.terms(structure.setting, active.variant)) if active.effect.terms else 0
        for _, value in active.effect.fixed_terms(v) if active.effect.fixed_terms else ():
            out[k] = value
            k += 1
    return out


def _loading(structure: Structure, values: list[dict[str, float]], log: str) -> FloatArray:
    """Factor on each coefficient in this log, from effects on loading and depth."""
    factor = np.ones(len(structure.table.terms))
    for active, v in zip(structure.actives, values, strict=True):
        if active.effect.loading is None or log not in active.variant.options["logs"]:  # type: ignore[operator]
            continue
        inertia, hull = active.effect.loading(v)
        for k, term in enumerate(structure.table.terms):
            if term.dof not in ("e1", "e2"):
                factor[k] *= 1.0 if term.role == "inertial" else 1.0 / inertia
                factor[k] *= hull if term.role == "hull" else 1.0
    return factor


def sensor_of(
    structure: Structure, p: FloatArray, values: list[dict[str, float]] | None = None
) -> FloatArray:
    """Parameters of the sensors (9,): what effects on sensors and clocks make of them."""
    if values is None:
        values = [structure.values(p, e) for e in range(len(structure.actives))]
    vessel = structure.vessel
    out = np.zeros(NM)
    out[2] = 1.0
    out[3], out[4] = vessel.antenna
    for active, v in zip(structure.actives, values, strict=True):
        if active.effect.sensor:
            _add(out, active.effect.sensor(v, active.variant.options))
    return out


def _add(out: FloatArray, shift: SensorShift) -> None:
    out[0] += shift.heading_bias
    out[1] += shift.gyro_bias
    out[2] += shift.gyro_scale
    out[3] += shift.antenna[0]
    out[4] += shift.antenna[1]
    for stream, offset in shift.clock.items():
        out[_CLOCKS[stream]] += offset


def directions(structure: Structure, p: FloatArray, stretch: Stretch, here: Drive) -> Directions:
    """Derivatives of the drive ``here`` along the general parameters, by central differences of the drive alone."""
    general = structure.general
    coefficients = np.zeros((len(general), len(structure.table.terms)))
    current, sensor = np.zeros((2, len(general))), np.zeros((NM, len(general)))
    driven: list[tuple[int, int]] = []
    columns: list[tuple[FloatArray, FloatArray]] = []
    carrying = {k: c for c, k in flow_channels(structure).items()}
    for g, k in enumerate(general):
        if k in carrying:
            driven.append((CHANNEL + structure.table.channels.index(carrying[k]), g))
            columns.append((np.ones(stretch.steps), np.zeros(stretch.steps)))
            continue
        same = None if _moves_inputs(structure, int(k)) else here
        high, low = _moved(structure, p, int(k), 1.0), _moved(structure, p, int(k), -1.0)
        width = high[k] - low[k]
        up, down = drive(structure, high, stretch, same), drive(structure, low, stretch, same)
        coefficients[g] = (up.coefficients - down.coefficients) / width
        current[:, g] = (up.current - down.current) / width
        sensor[:, g] = (up.sensor - down.sensor) / width
        for place, value, slope in _moving(up, down, width, same is None):
            driven.append((place, g))
            columns.append((value, slope))
    empty = np.zeros((stretch.steps, 0))
    values, slopes = (np.column_stack([empty, *(c[j] for c in columns)]) for j in (0, 1))
    return Directions(
        coefficients, np.array(driven, dtype=np.int64).reshape(-1, 2), values, slopes, current, sensor
    )


def _moving(
    up: Drive, down: Drive, width: float, inputs: bool
) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """Place, derivative (n,) and derivative of the slope (n,) of everything over time that is not the same in both."""
    if inputs:
        value, slope = (up.channels - down.channels) / width, (up.slopes - down.slopes) / width
        for k in np.nonzero(value.any(axis=0) | slope.any(axis=0))[0]:
            yield CHANNEL + int(k), value[:, k], slope[:, k]
    air = up.current - down.current
    if air.any() or up.wind is not down.wind:
        change = (up.wind - down.wind - air) / width
        for place, column in zip(AIR, change.T, strict=True):
            if column.any():
                yield place, column, np.zeros(len(column))


def _moves_inputs(structure: Structure, k: int) -> bool:
    """Whether a parameter changes what the actuators do."""
    slot = structure.slots[k]
    if slot.effect < 0:
        return True
    effect = structure.actives[slot.effect].effect
    return bool(effect.actuator or effect.gain or effect.input_delay or effect.rewire)


def _moved(structure: Structure, p: FloatArray, k: int, sign: float) -> FloatArray:
    """``p`` with one parameter moved by a small part of its scale, within its bounds."""
    parameter = structure.slots[k].parameter
    out = p.copy()
    out[k] = np.clip(p[k] + sign * 0.02 * parameter.scale, *parameter.bounds)
    return out
