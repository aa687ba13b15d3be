"""Wind that an autopilot gives as the velocity of the air: its speed, and where it comes from."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

#: Topic, and the columns with the velocity of the air to the north and to the east, m/s.
VELOCITIES: tuple[tuple[str, str, str], ...] = (
    ("WIND_COV", "wind_x", "wind_y"),
    (r"(wind|wind_estimate)(\[\d+\])?", "windspeed_north", "windspeed_east"),
)
SPEED, FROM = "wind_speed", "wind_from_deg"


def with_wind(topic: str, table: pd.DataFrame) -> pd.DataFrame:
    """Add ``wind_speed`` (m/s) and ``wind_from_deg`` (0 to 360) to a table that has the wind's components."""
    for pattern, north, east in VELOCITIES:
        if re.fullmatch(pattern, topic) and {north, east} <= set(table.columns):
            to_north, to_east = (table[c].to_numpy(dtype=float) for c in (north, east))
            with np.errstate(all="ignore"):  # damaged values may be anything
                speed = np.hypot(to_north, to_east)
                angle = np.degrees(np.arctan2(-to_east, -to_north)) % 360.0
            return table.assign(**{SPEED: speed, FROM: angle})
    return table
