"""Which NMEA 2000 tables look like position, heading and the rest.

Where one device reports several rudders or engines, each is also a table of its own: ``rudder[0]``,
``rudder[1]``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from ingest.detect import Rule, detect, precision
from ingest.log import SOURCE, Source

LATITUDE_LONGITUDE = {"latitude": "latitude", "longitude": "longitude"}
#: Usual errors, m, of the methods of a fix: plain, differential, precise, RTK fixed, RTK float, simulated.
USUAL_ERRORS: Mapping[int, float] = {1: 2.5, 2: 1.0, 3: 1.0, 4: 0.02, 5: 0.3, 8: 2.5}
RULES = (
    Rule("position", "positionRapidUpdate", LATITUDE_LONGITUDE, "deg", 50),
    Rule("position", "gnssPositionData", LATITUDE_LONGITUDE, "deg", 48,
         {"quality": "method", "quality_in": tuple(USUAL_ERRORS), "satellites": "numberOfSvs", "hdop": "hdop"}),
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
    plain = list(precise(detect(RULES, tables), tables))
    found = [*plain, *without_reference(tables, plain), *actuators(tables)]
    return tuple(sorted(found, key=lambda s: -s.rank))


def precise(found: Iterable[Source], tables: Mapping[str, pd.DataFrame]) -> Iterator[Source]:
    """The sources, all positions of a device ranked by the kind of fix that its detailed message states."""
    table = tables.get("gnssPositionData")
    kinds = Rule("position", "", {}, "deg", 0, {"quality": "method", "fixes": USUAL_ERRORS, "hdop": "hdop"})
    for source in found:
        if source.quantity != "position" or table is None:
            yield source
            continue
        rows = table[table[SOURCE] == source.device]
        yield replace(source, rank=source.rank + (precision(kinds, rows) if len(rows) else 0.0))


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
        for topic, table in tables.items():
            if topic.partition("[")[0] != rule.topic:
                continue
            mixed = mixed_devices(table, rule) if topic == rule.topic else frozenset()
            for source in detect([replace(rule, topic=re.escape(topic))], {topic: table}):
                if source.device not in mixed:
                    rows = table[table[SOURCE] == source.device]
                    yield replace(source, rank=source.rank - doubts(rows, rule))


def instance_tables(tables: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """``topic[k]`` for each instance k of actuators of which one device reports several."""
    out = {}
    for rule in ACTUATORS:
        table = tables.get(rule.topic)
        if table is not None and mixed_devices(table, rule):
            for number in np.unique(valued(table, rule)["instance"].dropna().to_numpy()).tolist():
                out[f"{rule.topic}[{int(number)}]"] = table[table["instance"] == number]
    return out


def mixed_devices(table: pd.DataFrame, rule: Rule) -> frozenset[int]:
    """Devices that report values of more than one instance."""
    if "instance" not in table.columns:
        return frozenset()
    instances = valued(table, rule).groupby(SOURCE)["instance"].nunique()
    return frozenset(int(device) for device in instances.index[instances > 1])


def valued(table: pd.DataFrame, rule: Rule) -> pd.DataFrame:
    """The rows that have a value."""
    rows: pd.DataFrame = table[np.isfinite(table[rule.fields["value"]].to_numpy(dtype=float))]
    return rows


def doubts(rows: pd.DataFrame, rule: Rule) -> float:
    """How much less an actuator's feedback is worth: it never moves, or is where no rudder can be."""
    values = valued(rows, rule)[rule.fields["value"]].to_numpy(dtype=float)
    stuck = STUCK if len(values) > 1 and np.ptp(values) == 0.0 else 0.0
    far = rule.quantity == "rudder" and abs(float(np.median(values))) > IMPLAUSIBLE_RUDDER
    return stuck + (IMPLAUSIBLE if far else 0.0)
