"""UTC of a DataFlash log, from the GPS week and time of week that its receiver gave."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.gps_time import gps_to_utc_ns
from ingest.log import Finding

#: Columns of the week and of the milliseconds of the week; new and old logs.
NAMES = (("GWk", "GMS"), ("Week", "TimeMS"))
#: Offsets between the two clocks must agree within this.
AGREE_NS = 1_000_000_000


def utc_of_zero(tables: Mapping[str, pd.DataFrame]) -> tuple[int | None, list[Finding]]:
    """UTC at index value 0, if a receiver knew it.

    A week and time that never change, do not run with the log's clock, or are nothing but that clock (the
    time of week equals the time since boot) are placeholders.
    """
    for topic in ("GPS", "GPS[0]", "GPS[1]", "GPS2"):
        columns = tables[topic].columns if topic in tables else ()
        for week, milliseconds in NAMES:
            if week in columns and milliseconds in columns:
                offset = clock_offset(tables[topic], week, milliseconds)
                if offset is not None:
                    return offset, []
    if "GPS" in tables:
        return None, [
            Finding("clock", "the GPS week and time are placeholders; UTC is not known", topic="GPS")
        ]
    return None, []


def clock_offset(table: pd.DataFrame, week: str, milliseconds: str) -> int | None:
    """UTC less the log's clock, in nanoseconds; None where the receiver had no time."""
    t = table.index.to_numpy()
    weeks, ms = (table[c].to_numpy(dtype=float) for c in (week, milliseconds))
    good = (weeks > 0) & (weeks < 10_000) & (ms >= 0) & (ms < 7 * 86_400_000)
    if "Status" in table and (table["Status"].to_numpy() >= 3)[good].any():
        good &= table["Status"].to_numpy() >= 3
    if not good.any() or (ms == t // 1_000_000)[good].all():
        return None
    utc = gps_to_utc_ns(weeks[good].astype(np.int64), ms[good].astype(np.int64) * 1_000_000)
    return agreed(utc, utc - t[good])


def agreed(utc: NDArray[np.int64], offset: NDArray[np.int64]) -> int | None:
    """Give the median offset, if time passes and most offsets agree with it."""
    middle = int(np.partition(offset, len(offset) // 2)[len(offset) // 2])
    if len(offset) > 1 and int(utc.min()) == int(utc.max()):
        return None
    return middle if np.mean(np.abs(offset - middle) < AGREE_NS) > 0.5 else None
