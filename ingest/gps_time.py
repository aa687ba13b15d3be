"""GPS time to UTC, with the leap seconds of the date.

The table is that of the IERS, Bulletin C: the UTC days at whose start GPS time moved one second further
ahead of UTC (it was equal to UTC on 6 January 1980). None has been announced since that of 2017.
"""

from __future__ import annotations

import datetime

import numpy as np
from numpy.typing import ArrayLike, NDArray

SECOND = 1_000_000_000
WEEK_NS = 7 * 86_400 * SECOND
#: Unix time of the GPS epoch, 1980-01-06T00:00:00Z, in nanoseconds.
GPS_EPOCH_NS = 315_964_800 * SECOND

LEAP_DAYS: tuple[str, ...] = (
    "1981-07-01", "1982-07-01", "1983-07-01", "1985-07-01", "1988-01-01", "1990-01-01", "1991-01-01",
    "1992-07-01",
    "1993-07-01", "1994-07-01", "1996-01-01", "1997-07-01", "1999-01-01", "2006-01-01", "2009-01-01",
    "2012-07-01",
    "2015-07-01", "2017-01-01",
)  # fmt: skip


def unix_day_ns(day: str) -> int:
    """Unix time of the start of a UTC day."""
    midnight = datetime.datetime.fromisoformat(day).replace(tzinfo=datetime.UTC)
    return int(midnight.timestamp()) * SECOND


#: GPS time (as if it were Unix time, in ns) from which one more leap second counts.
LEAP_FROM_NS = np.array(
    [unix_day_ns(day) + i * SECOND for i, day in enumerate(LEAP_DAYS, start=1)], dtype=np.int64
)


def leap_seconds(gps_ns: ArrayLike) -> NDArray[np.int64]:
    """Seconds that GPS time is ahead of UTC.

    Parameters
    ----------
    gps_ns : array_like of int
        GPS time in nanoseconds, counted from the Unix epoch without leap seconds.
    """
    return np.searchsorted(LEAP_FROM_NS, np.asarray(gps_ns, dtype=np.int64), side="right").astype(np.int64)


def gps_to_utc_ns(week: ArrayLike, time_of_week_ns: ArrayLike) -> NDArray[np.int64]:
    """Unix time in nanoseconds of GPS week and time of week.

    Parameters
    ----------
    week : array_like of int
        Full GPS week (not modulo 1024).
    time_of_week_ns : array_like of int
        Nanoseconds since the start of the week.
    """
    week_ns = np.asarray(week, dtype=np.int64) * WEEK_NS
    gps_ns = GPS_EPOCH_NS + week_ns + np.asarray(time_of_week_ns, dtype=np.int64)
    return np.asarray(gps_ns - leap_seconds(gps_ns) * SECOND, dtype=np.int64)
