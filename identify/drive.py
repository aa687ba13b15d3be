"""What drives a stretch for given parameters: channels, coefficients, current, air and sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identify.acting import Share, Values, constant_channels, flow_channels, lead_slot, shares_of
from identify.effect import SensorShift
from identify.kernel import CHANNEL, NM
from identify.resample import rates, straight_lines
from identify.stretch import SUBSTEPS, Stretch
from identify.structure import Structure
from identify.term import FACTORS

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

_CLOCKS = {"position": 5, "heading": 6, "yaw_rate": 7, "velocity": 8}


@dataclass(frozen=True)
class Drive:
    """Everything that the compiled rollout and the measurement equation need, beside the initial state.

    ``channels`` (n, nc) mean over each step and ``slopes`` (n, nc) of the straight line with the same first moment (end
    less middle), made of a ``constant`` (nc,) and what the inputs put in, the ``shares``; ``coefficients`` (p,),
    ``wind`` (n, 2), ``current`` (2,), ``sensor`` (9,); ``factor`` (p,) is what effects on loading make of each
    coefficient in this log (already in ``coefficients``); ``u0`` the speed that terms in Δu are about, m/s.
    """

    channels: FloatArray
    slopes: FloatArray
    constant: FloatArray
    shares: tuple[Share, ...]
    coefficients: FloatArray
    wind: FloatArray
    current: FloatArray
    sensor: FloatArray
    factor: FloatArray
    u0: float = 0.0

    @cached_property
    def fine(self) -> FloatArray:
        """The channels (nc, n·SUBSTEPS) on the fine grid."""
        out = np.repeat(self.constant[:, None], len(self.channels) * SUBSTEPS, axis=1)
        for share in self.shares:
            out[list(share.places)] += share.fine
        return out


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


def drive(structure: Structure, p: FloatArray, stretch: Stretch) -> Drive:
    """Evaluate effects on inputs, water, air, loading and sensors for one stretch."""
    values = _values(structure, p)
    rest = _rest(structure, p, values, stretch.name)
    return replace(
        _acting(structure, p, values, stretch), coefficients=rest.coefficients, wind=stretch.wind + rest.air,
        current=rest.current, sensor=rest.sensor, factor=rest.factor, u0=structure.u0_at(p),
    )  # fmt: skip


class _Rest(NamedTuple):
    """What of a drive is the same at all times: with ``air`` (2,) of the wind that no log has; else as in ``Drive``."""

    coefficients: FloatArray
    factor: FloatArray
    current: FloatArray
    air: FloatArray
    sensor: FloatArray


def _rest(structure: Structure, p: FloatArray, values: list[dict[str, float]], log: str) -> _Rest:
    current, air = np.zeros(2), np.zeros(2)
    for active, v in zip(structure.actives, values, strict=True):
        if active.effect.current:
            current = current + np.array(active.effect.current(v))
        if active.effect.air:
            air = air + np.array(active.effect.air(v))
    factor = _loading(structure, values, log)
    coefficients = factor * _coefficients(structure, p, values)
    return _Rest(coefficients, factor, current, air, sensor_of(structure, p, values))


def _values(structure: Structure, p: FloatArray) -> list[dict[str, float]]:
    """Named parameter values of every active effect."""
    return [structure.values(p, e) for e in range(len(structure.actives))]


def _acting(structure: Structure, p: FloatArray, values: Values, stretch: Stretch) -> Drive:
    """What the inputs do, and nothing else."""
    constant = constant_channels(structure, p)
    shares = tuple(shares_of(structure, p, values, stretch))
    mean, slope = np.tile(constant, (stretch.steps, 1)), np.zeros((stretch.steps, len(constant)))
    for share in shares:
        mean += share.mean
        slope += share.slope
    nothing = np.zeros(0)
    return Drive(mean, slope, constant, shares, nothing, nothing, nothing, nothing, nothing)


def _coefficients(structure: Structure, p: FloatArray, values: list[dict[str, float]]) -> FloatArray:
    out = np.zeros(len(structure.table.terms))
    for k, slot in enumerate(structure.slots):
        if slot.coefficient >= 0:
            out[slot.coefficient] = p[k]
    k = len(structure.setting.terms)
    for _, _, value in structure.model.fixed:
        out[k] = value
        k += 1
    for active, v, free in zip(structure.actives, values, structure.free_terms, strict=True):
        k += len(free)
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
        by = active.effect.loading(v, active.variant.options)
        for k, term in enumerate(structure.table.terms):
            if term.dof not in ("e1", "e2"):
                factor[k] *= by.inertial if term.role == "inertial" else by.others
                factor[k] *= by.hull if term.role == "hull" else 1.0
    return factor


def sensor_of(
    structure: Structure, p: FloatArray, values: list[dict[str, float]] | None = None
) -> FloatArray:
    """Parameters of the sensors (9,): what effects on sensors and clocks make of them."""
    if values is None:
        values = _values(structure, p)
    vessel = structure.vessel
    out = np.zeros(NM)
    out[2] = 1.0
    out[3], out[4] = vessel.antenna
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


def directions(structure: Structure, p: FloatArray, stretch: Stretch, here: Drive) -> Directions:
    """Derivatives of the drive ``here`` along the general parameters, by central differences of the drive alone."""
    general, n = structure.general, stretch.steps
    coefficients = np.zeros((len(general), len(structure.table.terms)))
    current, sensor = np.zeros((2, len(general))), np.zeros((NM, len(general)))
    driven: list[tuple[int, int]] = []
    columns: list[tuple[FloatArray, FloatArray]] = []
    for g, k in enumerate(general):
        both = [_moved(structure, p, int(k), sign) for sign in (1.0, -1.0)]
        width = both[0][k] - both[1][k]
        up, down = (_rest(structure, q, _values(structure, q), stretch.name) for q in both)
        coefficients[g] = (up.coefficients - down.coefficients) / width
        current[:, g] = (up.current - down.current) / width
        sensor[:, g] = (up.sensor - down.sensor) / width
        air = zip(AIR, (up.air - down.air) / width - current[:, g], strict=True)
        steady = ((place, np.full(n, value), np.zeros(n)) for place, value in air if value)
        for place, value, slope in (*steady, *_driven(structure, both, stretch, here, int(k))):
            driven.append((place, g))
            columns.append((value, slope))
    empty = np.zeros((n, 0))
    values, slopes = (np.column_stack([empty, *(c[j] for c in columns)]) for j in (0, 1))
    return Directions(
        coefficients, np.array(driven, dtype=np.int64).reshape(-1, 2), values, slopes, current, sensor
    )


#: Place, derivative and derivative of the slope (n,) of what a parameter moves over time.
_Moving = tuple[int, FloatArray, FloatArray]


def _driven(
    structure: Structure, both: Sequence[FloatArray], stretch: Stretch, here: Drive, k: int
) -> Iterator[_Moving]:
    """What one general parameter moves of the factors and channels; ``both`` have it a little higher, and lower."""
    n, carrying = stretch.steps, {slot: name for name, slot in flow_channels(structure).items()}
    if k in carrying:
        yield CHANNEL + structure.table.channels.index(carrying[k]), np.ones(n), np.zeros(n)
    elif k == structure.u0_place:
        yield FACTORS.index("Δu"), np.full(n, -1.0), np.zeros(n)
    elif k == lead_slot(structure):
        yield from _changing(*_by_lead(here, stretch))
    elif _moves_inputs(structure, k):
        more, less = (_acting(structure, q, _values(structure, q), stretch) for q in both)
        width = both[0][k] - both[1][k]
        yield from _changing((more.channels - less.channels) / width, (more.slopes - less.slopes) / width)


def _by_lead(here: Drive, stretch: Stretch) -> tuple[FloatArray, FloatArray]:
    """Derivatives (n, nc) of channels and slopes by a lead of all inputs: what they do a little later, they do now."""
    mean, slope = straight_lines(rates(here.fine, stretch.h / SUBSTEPS), SUBSTEPS)
    return mean, slope


def _changing(value: FloatArray, slope: FloatArray) -> Iterator[_Moving]:
    """The channels that change at all."""
    for k in np.nonzero(value.any(axis=0) | slope.any(axis=0))[0]:
        yield CHANNEL + int(k), value[:, k], slope[:, k]


def _moves_inputs(structure: Structure, k: int) -> bool:
    """Whether a parameter changes what the actuators do."""
    slot = structure.slots[k]
    if slot.effect < 0:
        return k not in structure.clock_slots.values()
    effect = structure.actives[slot.effect].effect
    return bool(effect.actuator or effect.gain or effect.input_delay or effect.rewire)


def _moved(structure: Structure, p: FloatArray, k: int, sign: float) -> FloatArray:
    """``p`` with one parameter moved by a small part of its scale, within its bounds."""
    parameter = structure.slots[k].parameter
    out = p.copy()
    out[k] = np.clip(p[k] + sign * 0.02 * parameter.scale, *parameter.bounds)
    return out
