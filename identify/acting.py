"""What the inputs do over a stretch: the actuators' series, and what each puts into the channels.

What an input does is remembered as long as no effect acts on it, so that a search which changes one does not make the
others again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.actuator_dynamics import Before
from identify.flow import PARAMETERS, channel_of
from identify.forces import THRUSTING, shares, thrust
from identify.resample import straight_lines
from identify.stretch import SUBSTEPS, Stretch
from identify.structure import Rewiring, Structure
from preprocess.vessel import Input

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Values = Sequence[dict[str, float]]


@dataclass(frozen=True)
class Share:
    """What inputs that act together, the ``unit``, put into the channels.

    ``places`` (k,) of the channels that they drive; ``fine`` (k, n·SUBSTEPS) of those; ``mean`` and ``slope`` (n, nc)
    of the lines through it, in all channels.
    """

    unit: tuple[Input, ...]
    places: tuple[int, ...]
    fine: FloatArray
    mean: FloatArray
    slope: FloatArray


def shares_of(
    structure: Structure, p: FloatArray, values: Values, stretch: Stretch, answering: tuple[str, ...] = ()
) -> list[Share]:
    """What every unit of inputs puts into the channels; or those alone that may answer to some of the inputs."""
    inputs, names = structure.inputs, structure.table.channels
    begins = input_clocks(structure, p, stretch, values)
    rewired = structure.rewiring
    found = []
    for unit in structure.units:
        if answering and not rewired.labels and not any(i.name in answering for i in unit):
            continue
        if any(i.name in structure.acted_on for i in unit):
            series = _series(structure, values, stretch, begins, unit)
            found.append(_share(names, inputs, unit, series, stretch))
        else:
            needed = begins if rewired.labels else {i.name: begins[i.name] for i in unit}
            key = (names, inputs, unit, tuple(needed.items()), rewired)
            found.append(stretch.remembered(_untouched, *key))
    return found


def summed(constant: FloatArray, some: Sequence[Share], stretch: Stretch) -> tuple[FloatArray, FloatArray]:
    """Mean and slope (n, nc) of the channels' lines: a constant (nc,) and what some inputs put in."""
    mean, slope = np.tile(constant, (stretch.steps, 1)), np.zeros((stretch.steps, len(constant)))
    for share in some:
        mean += share.mean
        slope += share.slope
    return mean, slope


def constant_channels(structure: Structure, p: FloatArray) -> FloatArray:
    """Channels (nc,) before any input does anything."""
    flow = {c: float(p[k]) for c, k in flow_channels(structure).items()}
    return np.array([-1.0 if name == "−" else flow.get(name, 0.0) for name in structure.table.channels])


def flow_channels(structure: Structure) -> dict[str, int]:
    """Channels that carry the parameters of the flow behind the hull, and their slots."""
    names = {q.name for q in PARAMETERS} if structure.model.flow else set()
    return {channel_of(s.name): k for k, s in enumerate(structure.slots) if s.effect < 0 and s.name in names}


def _untouched(
    stretch: Stretch,
    names: tuple[str, ...],
    inputs: tuple[Input, ...],
    unit: tuple[Input, ...],
    begins: tuple[tuple[str, float], ...],
    rewired: Rewiring,
) -> Share:
    """What inputs of one unit do on which no effect acts but delays and wiring."""
    series, switching = _logged(stretch, dict(begins), rewired, {i.name for i in unit})
    return _share(names, inputs, unit, series | _thrusts(unit, series, switching), stretch)


def _share(
    names: tuple[str, ...],
    inputs: tuple[Input, ...],
    unit: tuple[Input, ...],
    series: dict[str, FloatArray],
    stretch: Stretch,
) -> Share:
    places, fine = shares(names, inputs, unit, series)
    fine = fine.reshape(len(places), stretch.steps * SUBSTEPS)
    mean, slope = (among(len(names), places, lines) for lines in straight_lines(fine, SUBSTEPS))
    return Share(unit, places, fine, mean, slope)


def among(channels: int, places: tuple[int, ...], lines: FloatArray) -> FloatArray:
    """Columns (n, k) at their places among all channels (n, nc)."""
    out = np.zeros((len(lines), channels))
    out[:, list(places)] = lines
    return out


def actuators_of(
    structure: Structure, p: FloatArray, values: Values, stretch: Stretch
) -> dict[str, FloatArray]:
    """Each input as the actuator made it, and ``"thrust NAME"`` with gains, on the fine grid (n·SUBSTEPS,)."""
    begins = input_clocks(structure, p, stretch, values)
    return _series(structure, values, stretch, begins, structure.inputs)


def _series(
    structure: Structure,
    values: Values,
    stretch: Stretch,
    begins: dict[str, float],
    some: tuple[Input, ...],
) -> dict[str, FloatArray]:
    """Some inputs as the actuator made them, and their thrusts."""
    dt, names = stretch.h / SUBSTEPS, {i.name for i in some}
    series, switching = _logged(stretch, begins, structure.rewiring, names)
    before = _before(structure, stretch, begins, names)
    for active, v in zip(structure.actives, values, strict=True):
        if not active.effect.actuator:
            continue
        for name in names.intersection(active.variant.inputs):
            earlier = replace(before[name], begin=active.begin.get(stretch.name, 0.0))
            command = series[name], switching[name]
            series[name], switching[name] = active.effect.actuator(
                v, command, dt, active.variant.options, earlier
            )
    forces = _thrusts(some, series, switching)
    time = stretch.campaign_time + dt * (np.arange(stretch.steps * SUBSTEPS, dtype=float) + 0.5)
    for active, v in zip(structure.actives, values, strict=True):
        for item in some:
            if active.effect.gain and item.kind in THRUSTING and active.variant.acts_on(item.name):
                forces[f"thrust {item.name}"] = forces[f"thrust {item.name}"] * active.effect.gain(v, time)
    return series | forces


def _before(
    structure: Structure, stretch: Stretch, begins: dict[str, float], names: set[str]
) -> dict[str, Before]:
    """What some inputs were before a stretch, as they are wired."""
    needed = begins if structure.rewiring.labels else {n: begins[n] for n in names}
    found = {n: stretch.before(n, begin) for n, begin in needed.items()}
    told = {n: x.told for n, x in found.items()}
    lasted = {n: x.lasted for n, x in found.items()}
    for active in structure.rewiring.actives:
        if active.effect.rewire:
            told, lasted = (active.effect.rewire(active.variant.options, x) for x in (told, lasted))
    return {n: Before(told[n], np.abs(lasted[n])) for n in found}


def _logged(
    stretch: Stretch, begins: dict[str, float], rewired: Rewiring, names: set[str]
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Some inputs' logged values on the fine grid as they are wired, and what switching adds to their square."""
    needed = begins if rewired.labels else {n: begins[n] for n in names}
    acting = {n: stretch.acting(n, begin) for n, begin in needed.items()}
    series, switching = ({n: a[k] for n, a in acting.items()} for k in (0, 1))
    for active in rewired.actives:
        if active.effect.rewire:
            series, switching = (active.effect.rewire(active.variant.options, x) for x in (series, switching))
    return {n: series[n] for n in names}, switching


def _thrusts(
    some: tuple[Input, ...], series: dict[str, FloatArray], switching: dict[str, FloatArray]
) -> dict[str, FloatArray]:
    """Thrust up to its gain of every input that gives any, with what its moving within a step adds to the square."""
    found = {}
    for item in some:
        if item.kind in THRUSTING:
            more = 0.0 if item.law == "linear" else switching[item.name]
            found[f"thrust {item.name}"] = thrust(item, series[item.name]) + more
    return found


def input_clocks(
    structure: Structure, p: FloatArray, stretch: Stretch, values: Values | None = None
) -> dict[str, float]:
    """Time on each input's log, s, of what acts when a stretch begins."""
    if values is None:
        values = [structure.values(p, e) for e in range(len(structure.actives))]
    begin, held = stretch.start + _lead(structure, p), _held_lead(structure)
    late = {n: 0.0 if m.held else held for n, m in stretch.inputs.items()}
    return {i.name: begin - late[i.name] - _delay(structure, values, i.name) for i in structure.inputs}


def lead_slot(structure: Structure) -> int | None:
    """Where the lead of the inputs stands among the parameters, where it is one."""
    return next((k for k, s in enumerate(structure.slots) if s.name == "input_lead" and s.effect < 0), None)


def _lead(structure: Structure, p: FloatArray) -> float:
    """How far the actuators are ahead of the logged inputs, s; the expected lead where it is not a parameter."""
    slot = lead_slot(structure)
    return _held_lead(structure) if slot is None else float(p[slot])


def _held_lead(structure: Structure) -> float:
    """How far actuators are expected to be ahead of an input that holds, s: by so much more than of one that moves."""
    return structure.input_lead[0] if structure.input_lead is not None else 0.0


def _delay(structure: Structure, values: Values, name: str) -> float:
    return sum(
        active.effect.input_delay(v)
        for active, v in zip(structure.actives, values, strict=True)
        if active.effect.input_delay and active.variant.acts_on(name)
    )
