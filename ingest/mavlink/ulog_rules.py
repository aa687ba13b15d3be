"""Which ULog topics carry position, heading and the rest."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from ingest.detect import Rule
from ingest.mavlink.mavlink_rules import USUAL_ERRORS

INSTANCE = r"(\[\d+\])?"
GPS = rf"(vehicle_gps_position|sensor_gps){INSTANCE}"
GPS_OPTIONS: Mapping[str, object] = {
    "quality": "fix_type",
    "quality_min": 2,
    "satellites": "satellites_used",
    "hdop": "hdop",
    "accuracy": "eph",
    "time": "time_utc_usec",
    "time_unit": "us",
    "fixes": USUAL_ERRORS,
}
FIX: Mapping[str, object] = {"quality": "fix_type", "quality_min": 2}
SPEED_FIX: Mapping[str, object] = {**FIX, "accuracy": "s_variance_m_s"}
WIND: Mapping[str, object] = {"speed_unit": "m/s", "reference": "true"}
DOWN: Mapping[str, object] = {"quality": "orientation", "quality_in": (25,)}

RULES: tuple[Rule, ...] = (
    Rule("position", GPS, {"latitude": "latitude_deg", "longitude": "longitude_deg"}, "deg", 50, GPS_OPTIONS),
    Rule("position", GPS, {"latitude": "lat", "longitude": "lon"}, "degE7", 50, GPS_OPTIONS),
    Rule("position", "vehicle_global_position", {"latitude": "lat", "longitude": "lon"}, "deg", 40),
    Rule("position", "vehicle_local_position", {"north": "x", "east": "y"}, "m", 30),
    Rule("heading", f"vehicle_attitude{INSTANCE}", {"value": "heading"}, "rad", 50),
    Rule("heading", "vehicle_local_position", {"value": "heading"}, "rad", 40),
    Rule("heading", GPS, {"value": "heading"}, "rad", 30, FIX),
    Rule("yaw_rate", f"vehicle_angular_velocity{INSTANCE}", {"value": "xyz[2]"}, "rad/s", 50),
    Rule("yaw_rate", f"vehicle_attitude{INSTANCE}", {"value": "yawspeed"}, "rad/s", 48),
    Rule("yaw_rate", f"sensor_combined{INSTANCE}", {"value": "gyro_rad[2]"}, "rad/s", 45),
    Rule("velocity", GPS, {"north": "vel_n_m_s", "east": "vel_e_m_s"}, "m/s", 50, SPEED_FIX),
    Rule("velocity", "vehicle_local_position", {"north": "vx", "east": "vy"}, "m/s", 40),
    Rule("wind", f"(wind|wind_estimate){INSTANCE}", {"speed": "wind_speed", "direction": "wind_from_deg"}, "deg", 40,
         WIND),
    Rule("depth", f"distance_sensor{INSTANCE}", {"value": "current_distance"}, "m", 40, DOWN),
)  # fmt: skip


def with_heading(topic: str, table: pd.DataFrame) -> pd.DataFrame:
    """Add a column ``heading`` (rad, clockwise from north) from an attitude as a quaternion (w, x, y, z)."""
    names = [f"q[{k}]" for k in range(4)]
    if not topic.startswith("vehicle_attitude") or not set(names) <= set(table.columns):
        return table
    with np.errstate(all="ignore"):  # damaged values may be anything
        w, x, y, z = (table[n].to_numpy(dtype=float) for n in names)
        heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return table.assign(heading=heading)
