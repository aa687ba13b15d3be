"""From the checked tables of a campaign to what the pipeline takes: SI units, radians, defaults filled in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from preprocess.vessel import Input, Sensor, Smoothing, Vessel
from seatrial.campaign.data import Campaign, LogEntry
from seatrial.campaign.sensor_rules import COMPONENTS, signals_of
from seatrial.campaign.tables import CampaignTable, InputTable, LogTable, SensorTable, VesselTable


def campaign_of(file: Path, table: CampaignTable) -> Campaign:
    """The campaign that a checked table says."""
    folder = file.parent
    return Campaign(
        path=file,
        vessel=replace(vessel_of(table.vessel), reference_speed=table.model.u0),
        inputs=inputs_of(table),
        sensors=tuple(
            sensor_of(quantity, sensor)
            for quantity in COMPONENTS
            if (sensor := getattr(table.sensors, quantity)) is not None
        ),
        logs=logs_of(folder, table.log),
        model=table.model.name,
        estimator=table.model.estimator,
        optimiser=table.model.optimiser,
        dbc=None if table.can.dbc is None else folder / table.can.dbc,
        smoothing=Smoothing(
            table.preprocess.smoother,
            None if table.preprocess.bandwidth is None else float(table.preprocess.bandwidth),
        ),
    )


def vessel_of(table: VesselTable) -> Vessel:
    """The vessel."""
    given = table.model_dump(
        exclude={"magnetic_variation_deg", "centre_of_gravity", "antenna", "imu", "added_mass"}
    )
    return Vessel(
        **given,
        centre_of_gravity=None if table.centre_of_gravity is None else point(table.centre_of_gravity),
        added_mass=None if table.added_mass is None else triple(table.added_mass),
        antenna=point(table.antenna),
        imu=point(table.imu),
        magnetic_variation=math.radians(table.magnetic_variation_deg),
    )


def triple(values: Sequence[float]) -> tuple[float, float, float]:
    """Three numbers."""
    return float(values[0]), float(values[1]), float(values[2])


def point(values: Sequence[float]) -> tuple[float, float]:
    """A pair of numbers."""
    return float(values[0]), float(values[1])


def inputs_of(table: CampaignTable) -> tuple[Input, ...]:
    """The inputs, in the order of the file."""
    stern = (-0.5 * table.vessel.length, 0.0)
    places = {name: place_of(name, table, stern) for name in table.inputs}
    return tuple(input_of(name, declared, places[name]) for name, declared in table.inputs.items())


def place_of(name: str, table: CampaignTable, stern: tuple[float, float]) -> tuple[float, float]:
    """Where an input acts: as declared, where its azimuth or its propeller is, or at the stern."""
    declared = table.inputs[name]
    partners = [i for i in table.inputs.values() if i.drives == name]
    if declared.drives is not None:
        partners.append(table.inputs[declared.drives])
    given = next((i.position for i in (declared, *partners) if i.position is not None), None)
    return stern if given is None else point(given)


def input_of(name: str, declared: InputTable, position: tuple[float, float]) -> Input:
    """One input."""
    law = declared.law or ("linear" if declared.unit == "N" else "quadratic")
    return Input(
        name=name,
        kind=declared.kind,
        signal=declared.signal,
        pwm=tuple(map(float, declared.pwm or ())),
        value=tuple(map(float, declared.value or ())),
        unit=declared.unit,
        law=law,
        position=position,
        drives=declared.drives,
        source=declared.source,
    )


def sensor_of(quantity: str, sensor: SensorTable) -> Sensor:
    """One sensor."""
    return Sensor(
        quantity=quantity,
        signals=signals_of(quantity, sensor),
        unit=sensor.unit,
        source=sensor.source,
        offset=float(getattr(sensor, "offset", 0.0)),
        latency=sensor.latency,
        reference=getattr(sensor, "reference", None),
    )


def logs_of(folder: Path, logs: Sequence[LogTable]) -> tuple[LogEntry, ...]:
    """The logs with their roles; none has one where none validates."""
    validates = any(log.role == "validate" for log in logs)
    return tuple(log_of(folder, log, (log.role or "identify") if validates else None) for log in logs)


def log_of(folder: Path, log: LogTable, role: str | None) -> LogEntry:
    """One log."""
    return LogEntry(
        path=log.path,
        file=folder / log.path,
        role=role,
        manoeuvre=log.manoeuvre,
        start=None if log.start is None else float(log.start),
        slice=None if log.slice is None else point(log.slice),
        format=log.format,
        dialect=log.dialect.model_dump(exclude_none=True),
        depth=None if log.depth is None else float(log.depth),
    )
