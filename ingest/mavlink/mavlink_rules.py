"""Which MAVLink messages carry position, heading and the rest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import pandas as pd

from ingest.detect import Rule
from ingest.log import SOURCE, Source

#: Of GPS_FIX_TYPE, as MAVLink, DataFlash and ULog share it: 2-D, 3-D, differential, RTK float, RTK fixed; m.
USUAL_ERRORS: Mapping[int, float] = {2: 5.0, 3: 2.5, 4: 1.0, 5: 0.3, 6: 0.02}
GPS_OPTIONS: Mapping[str, object] = {
    "quality": "fix_type",
    "quality_min": 2,
    "satellites": "satellites_visible",
    "hdop": "eph",
    "hdop_scale": 0.01,
    "accuracy": "h_acc",
    "accuracy_scale": 1e-3,
    "fixes": USUAL_ERRORS,
}
RECEIVER_TIME: Mapping[str, object] = {"time": "time_usec", "time_unit": "us"}
BOOT_TIME: Mapping[str, object] = {"time": "time_boot_ms", "time_unit": "ms"}
POSITION = {"latitude": "lat", "longitude": "lon"}
WIND = {"speed": "wind_speed", "direction": "wind_from_deg"}
COURSE = {"speed": "vel", "course": "cog"}
FIX = {"quality": "fix_type", "quality_min": 2}
SPEED_ACCURACY = {"accuracy": "vel_acc", "accuracy_scale": 1e-3}

RULES: tuple[Rule, ...] = (
    Rule("position", "GPS_RAW_INT", POSITION, "degE7", 50, {**GPS_OPTIONS, **RECEIVER_TIME}),
    Rule("position", "GPS2_RAW", POSITION, "degE7", 49, {**GPS_OPTIONS, **RECEIVER_TIME}),
    Rule("position", "GLOBAL_POSITION_INT", POSITION, "degE7", 40, BOOT_TIME),
    Rule("position", "LOCAL_POSITION_NED", {"north": "x", "east": "y"}, "m", 30, BOOT_TIME),
    Rule("heading", "ATTITUDE", {"value": "yaw"}, "rad", 50, BOOT_TIME),
    Rule("heading", "GLOBAL_POSITION_INT", {"value": "hdg"}, "cdeg", 40, BOOT_TIME),
    Rule("heading", "AHRS2", {"value": "yaw"}, "rad", 38),
    Rule("heading", "VFR_HUD", {"value": "heading"}, "deg", 30),
    Rule("yaw_rate", "ATTITUDE", {"value": "yawspeed"}, "rad/s", 50, BOOT_TIME),
    Rule("yaw_rate", "HIGHRES_IMU", {"value": "zgyro"}, "rad/s", 45, RECEIVER_TIME),
    Rule("yaw_rate", "SCALED_IMU", {"value": "zgyro"}, "mrad/s", 42, BOOT_TIME),
    Rule("velocity", "GPS_RAW_INT", COURSE, "cdeg", 50,
         {**FIX, **RECEIVER_TIME, **SPEED_ACCURACY, "speed_unit": "cm/s"}),
    Rule("velocity", "GLOBAL_POSITION_INT", {"north": "vx", "east": "vy"}, "cm/s", 40, BOOT_TIME),
    Rule("velocity", "LOCAL_POSITION_NED", {"north": "vx", "east": "vy"}, "m/s", 38, BOOT_TIME),
    Rule(
        "wind", "WIND", {"speed": "speed", "direction": "direction"}, "deg", 50,
        {"speed_unit": "m/s", "reference": "true"},
    ),
    Rule("wind", "WIND_COV", WIND, "deg", 48, {"speed_unit": "m/s", "reference": "true"}),
    Rule("depth", "WATER_DEPTH", {"value": "distance"}, "m", 50, BOOT_TIME),
)  # fmt: skip


def chosen_component(sources: Iterable[Source], tables: Mapping[str, pd.DataFrame]) -> tuple[Source, ...]:
    """Add ``where`` to the options of a source that several components of one system send.

    The autopilot (component 1) is chosen, or else the lowest component.
    """
    return tuple(one_component(s, tables[s.topic]) for s in sources)


def one_component(source: Source, table: pd.DataFrame) -> Source:
    """Give the source, restricted to one component where there are several."""
    components = table.loc[table[SOURCE] == source.device, "component"]
    lowest = int(components.min())
    if int(components.max()) == lowest:
        return source
    chosen = 1 if (components == 1).any() else lowest
    return replace(source, options={**source.options, "where": {"component": chosen}})
