"""Which DataFlash records carry position, heading and the rest."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from ingest.detect import Rule
from ingest.mavlink.mavlink_rules import USUAL_ERRORS

FIX: Mapping[str, object] = {"quality": "Status", "quality_min": 2}
GPS_OPTIONS: Mapping[str, object] = {
    **FIX,
    "satellites": "NSats",
    "hdop": "HDop",
    "time": "GMS",
    "time_unit": "ms",
    "accuracy": "HAcc",
    "fixes": USUAL_ERRORS,
}
GPS = r"GPS(\[\d+\])?"
FILTER = r"(XKF1|NKF1|EKF1)(\[\d+\])?"
WIND_TRUE: Mapping[str, object] = {"speed_unit": "m/s", "reference": "true"}
WIND_RELATIVE: Mapping[str, object] = {"speed_unit": "m/s", "reference": "relative"}

RULES: tuple[Rule, ...] = (
    Rule("position", GPS, {"latitude": "Lat", "longitude": "Lng"}, "deg", 50, GPS_OPTIONS),
    Rule("position", "GPS2", {"latitude": "Lat", "longitude": "Lng"}, "deg", 49, GPS_OPTIONS),
    Rule("position", "POS", {"latitude": "Lat", "longitude": "Lng"}, "deg", 40),
    Rule("position", FILTER, {"north": "PN", "east": "PE"}, "m", 30),
    Rule("heading", "ATT", {"value": "Yaw"}, "deg", 50),
    Rule("heading", FILTER, {"value": "Yaw"}, "deg", 40),
    Rule("heading", "AHR2", {"value": "Yaw"}, "deg", 38),
    Rule("heading", GPS, {"value": "Yaw"}, "deg", 30, FIX),
    Rule("yaw_rate", r"IMU(\[\d+\])?", {"value": "GyrZ"}, "rad/s", 50),
    Rule("yaw_rate", r"IMU[23]", {"value": "GyrZ"}, "rad/s", 49),
    Rule("yaw_rate", "RATE", {"value": "Y"}, "deg/s", 40),
    Rule("velocity", GPS, {"speed": "Spd", "course": "GCrs"}, "deg", 50,
         {**FIX, "speed_unit": "m/s", "accuracy": "SAcc"}),
    Rule("velocity", FILTER, {"north": "VN", "east": "VE"}, "m/s", 40),
    Rule("wind", "WIND", {"speed": "SpdT", "direction": "DirT"}, "deg", 50, WIND_TRUE),
    Rule("wind", "WIND", {"speed": "SpdA", "direction": "DirA"}, "deg", 45, WIND_RELATIVE),
    Rule("depth", r"DPTH(\[\d+\])?", {"value": "Depth"}, "m", 50),
    Rule("depth", r"RFND(\[\d+\])?", {"value": "Dist"}, "m", 40, {"quality": "Orient", "quality_in": (25,)}),
)  # fmt: skip

#: Accuracies that GPA records state beside the GPS record of the same instant.
ACCURACIES = ("HAcc", "VAcc", "SAcc")


def with_accuracy(tables: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Give the tables, those of GPS with the accuracies that GPA states for the same instant and instance."""
    out = dict(tables)
    for topic, table in tables.items():
        stated = tables.get(topic.replace("GPS", "GPA")) if topic.partition("[")[0] == "GPS" else None
        columns = [c for c in ACCURACIES if stated is not None and c in stated and c not in table]
        if stated is not None and columns:
            once = stated[~stated.index.duplicated()][columns].astype(float)
            out[topic] = table.assign(**{c: once[c].reindex(table.index).to_numpy() for c in columns})
    return out
