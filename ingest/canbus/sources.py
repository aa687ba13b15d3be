"""Which NMEA 2000 tables look like position, heading and the rest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from ingest.detect import Rule, detect
from ingest.log import SOURCE, Source

LATITUDE_LONGITUDE = {"latitude": "latitude", "longitude": "longitude"}
RULES = (
    Rule("position", "positionRapidUpdate", LATITUDE_LONGITUDE, "deg", 50),
    Rule("position", "gnssPositionData", LATITUDE_LONGITUDE, "deg", 48,
         {"quality": "method", "quality_in": (1, 2, 3, 4, 5), "satellites": "numberOfSvs", "hdop": "hdop"}),
    Rule("heading", "vesselHeading", {"value": "heading"}, "rad", 55,
         {"quality": "reference", "quality_in": (0,)}),
    Rule("heading", "vesselHeading", {"value": "heading"}, "rad", 45,
         {"quality": "reference", "quality_in": (1,), "magnetic": True}),
    Rule("heading", "attitude", {"value": "yaw"}, "rad", 25),
    Rule("yaw_rate", "rateOfTurn", {"value": "rate"}, "rad/s", 50),
    Rule("velocity", "cogSogRapidUpdate", {"speed": "sog", "course": "cog"}, "rad", 50,
         {"quality": "cogReference", "quality_in": (0,), "speed_unit": "m/s"}),
    Rule("velocity", "cogSogRapidUpdate", {"speed": "sog", "course": "cog"}, "rad", 40,
         {"quality": "cogReference", "quality_in": (1,), "magnetic": True, "speed_unit": "m/s"}),
    Rule("wind", "windData", {"speed": "windSpeed", "direction": "windAngle"}, "rad", 50,
         {"quality": "reference", "quality_in": (2,), "reference": "relative", "speed_unit": "m/s"}),
    Rule("wind", "windData", {"speed": "windSpeed", "direction": "windAngle"}, "rad", 45,
         {"quality": "reference", "quality_in": (0,), "reference": "true", "speed_unit": "m/s"}),
    Rule("depth", "waterDepth", {"value": "depth"}, "m", 50),
)  # fmt: skip
#: Actuators, of which one device may report several instances.
ACTUATORS = (
    Rule("rudder", "rudder", {"value": "position"}, "rad", 50),
    Rule("propeller", "engineParametersRapidUpdate", {"value": "speed"}, "rpm", 50),
    Rule("propeller", "engineParametersDynamic", {"value": "engineLoad"}, "%", 15),
)
#: No rudder stands there; a sensor that says so is not connected.
IMPLAUSIBLE_RUDDER = 1.4
STUCK, IMPLAUSIBLE = 10.0, 30.0
#: A heading or course whose reference is not said.
UNSAID = 8.0


def sources(tables: Mapping[str, pd.DataFrame]) -> tuple[Source, ...]:
    """Where each quantity can be taken from, best first within each quantity."""
    plain = list(detect(RULES, tables))
    found = [*plain, *without_reference(tables, plain), *actuators(tables)]
    return tuple(sorted(found, key=lambda s: -s.rank))


def without_reference(tables: Mapping[str, pd.DataFrame], known: list[Source]) -> Iterator[Source]:
    """Headings and courses of devices that never say whether they are true or magnetic."""
    have = {(s.quantity, s.topic, s.device) for s in known}
    rules = [
        r for r in RULES if r.quantity in ("heading", "velocity") and r.options.get("quality_in") == (0,)
    ]
    for rule in rules:
        options = {k: v for k, v in rule.options.items() if not k.startswith("quality")}
        for source in detect([replace(rule, rank=rule.rank - UNSAID, options=options)], tables):
            if (source.quantity, source.topic, source.device) not in have:
                yield source


def actuators(tables: Mapping[str, pd.DataFrame]) -> Iterator[Source]:
    """Rudders and propellers, one source per device and instance."""
    for rule in ACTUATORS:
        table = tables.get(rule.topic)
        if table is None:
            continue
        for source in detect([rule], {rule.topic: table}):
            rows = table[table[SOURCE] == source.device]
            for part, options in instances(rows, rule):
                yield replace(source, rank=source.rank - doubts(part, rule), options=options)


def instances(rows: pd.DataFrame, rule: Rule) -> Iterator[tuple[pd.DataFrame, dict[str, object]]]:
    """The rows of each instance that has values, and the option that selects it where there are several."""
    valued = rows[np.isfinite(rows[rule.fields["value"]].to_numpy(dtype=float))]
    if "instance" not in rows.columns:
        yield valued, {}
        return
    numbers = np.unique(valued["instance"].dropna().to_numpy())
    if len(numbers) < 2:
        several = len(numbers) == 1 and len(np.unique(rows["instance"].to_numpy())) > 1
        yield valued, selected(float(numbers[0])) if several else {}
        return
    for number in numbers.tolist():
        yield valued[valued["instance"] == number], selected(number)


def selected(instance: float) -> dict[str, object]:
    """The option that selects one instance."""
    return {"quality": "instance", "quality_in": (instance,)}


def doubts(rows: pd.DataFrame, rule: Rule) -> float:
    """How much less an actuator's feedback is worth: it never moves, or is where no rudder can be."""
    values = rows[rule.fields["value"]].to_numpy(dtype=float)
    if not len(values):
        return IMPLAUSIBLE
    stuck = STUCK if len(values) > 1 and np.ptp(values) == 0.0 else 0.0
    far = rule.quantity == "rudder" and abs(float(np.median(values))) > IMPLAUSIBLE_RUDDER
    return stuck + (IMPLAUSIBLE if far else 0.0)
