"""UTC of a CAN log whose own stamps do not tell it: from the time that NMEA 2000 devices send."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from ingest.log import Finding

#: System time, GNSS position data, and time and date: PGN and table, best first.
TIMES = {126992: "systemTime", 129029: "gnssPositionData", 129033: "timeDate"}
#: Days since 1970 before which no device has a fix.
FIRST_DAY = 10_000
#: The computer's clock may differ from the satellites' by this much before it is said, s.
AGREES_S = 1.0


def utc_of_zero(tables: Mapping[str, pd.DataFrame]) -> int | None:
    """UTC in nanoseconds at index 0, the median over all time messages; None where there are none."""
    for topic in TIMES.values():
        table = tables.get(topic)
        if table is None or not {"date", "time"} <= set(table.columns):
            continue
        day, second = table["date"].to_numpy(dtype=float), table["time"].to_numpy(dtype=float)
        good = np.isfinite(day) & np.isfinite(second) & (day > FIRST_DAY) & (second < 86_401.0)
        if good.any():
            utc = day[good].astype(np.int64) * 86_400 * 10**9 + np.rint(second[good] * 1e9).astype(np.int64)
            return int(np.median(utc - table.index.to_numpy()[good]))
    return None


def disagreement(tables: Mapping[str, pd.DataFrame]) -> tuple[Finding, ...]:
    """What to say where the recording computer's clock is not the satellites'."""
    late = utc_of_zero(tables)
    if late is None or abs(late) < AGREES_S * 1e9:
        return ()
    message = f"the computer's clock is {-late * 1e-9:+.3f} s from the time sent on the bus; its own is kept"
    return (Finding("clock", message),)
