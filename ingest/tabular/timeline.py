"""Time columns to nanoseconds."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.rarely import RARE, smaller_units, to_be_called, usual_step
from ingest.tabular.naming import UNITS, split_unit

Nanoseconds = NDArray[np.int64]

TIME_NAMES = (
    "utc", "utc_time", "time_utc", "timestamp_utc", "datetime", "date_time", "timestamp", "time", "t",
    "stamp",
    "epoch", "unix_time", "unixtime", "host_time", "gps_time", "elapsed", "elapsed_time", "time_boot",
    "seconds",
    "sec", "tid", "zeit", "time_s", "clock",
)  # fmt: skip

#: The column in which PX4's tools count microseconds since the start.
COUNTED = "timestamp"
#: No time since a start is so long, s; times since 1970 with rows this far apart, ns, are times since a start.
CENTURY, RARELY_DATED_NS = 4e9, 600_000_000_000
#: Text that is a date, a time of day, and both.
_DATE, _OF_DAY = r"\d{1,4}[./-]\d{1,2}[./-]\d{1,4}", r"\d{1,2}:\d\d:\d\d([.,]\d+)?"
DATE, OF_DAY, DATED = (re.compile(p) for p in (_DATE, _OF_DAY, rf"{_DATE}[ T]{_OF_DAY}(Z|[+-]\d\d:?\d\d)?"))

_SCALE = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1, "min": 60_000_000_000}
DAY_NS = 86_400_000_000_000
#: Spreadsheets count days from 1899-12-30: the day 1970-01-01, and those of 2000 and 2100; the time of day in s goes as
#: far, in longer steps than these.
DAY_OF_1970, FIRST_DAY, LAST_DAY, LONGEST_STEP = 25_569.0, 36_526.0, 73_051.0, 5e-4


@dataclass(frozen=True)
class Clock:
    """Times of the rows of a table.

    Attributes
    ----------
    ns : (n,) int64
        Nanoseconds; where ``utc``, since 1970.
    good : (n,) bool
        Rows that have a time.
    utc : bool
        Whether ``ns`` is UTC.
    column : str
        Where it came from.
    note : str
        What was made of the column, where it does not say so itself.
    """

    ns: Nanoseconds
    good: NDArray[np.bool_]
    utc: bool
    column: str
    note: str = ""


def clock_of(table: pd.DataFrame, units: Mapping[str, str] | None = None) -> Clock | None:
    """Return the time of each row, from the column that best looks like a clock; None where none does.

    ``units`` are those of columns that are stated outside their names.
    """

    def from_column(name: str) -> Clock | None:
        stated = UNITS.get((units or {}).get(name, "").lower(), "")
        return _from_column(table[name], name, stated if stated in _SCALE else split_unit(name)[1])

    flat = {split_unit(str(c))[0]: str(c) for c in reversed(table.columns)}
    if "date" in flat and "time" in flat and not pd.api.types.is_numeric_dtype(table[flat["time"]]):
        joined = table[flat["date"]].astype(str) + " " + table[flat["time"]].astype(str)
        return _from_text(joined, f"{flat['date']} {flat['time']}")
    if "sample_time_fine" in flat:
        return _from_ticks(table, flat)
    for name in TIME_NAMES:
        if name in flat:
            clock = from_column(flat[name])
            if clock is not None:
                return clock
    clock = _from_values(table)
    if clock is not None:
        return clock
    first = table.iloc[:, 0]
    rising = (
        pd.api.types.is_numeric_dtype(first) and len(first) > 2 and bool((first.diff().iloc[1:] > 0).all())
    )
    return from_column(str(table.columns[0])) if rising else None


def _from_values(table: pd.DataFrame) -> Clock | None:
    """Time by text that looks like it, whatever its columns are called: with the date, beside it, or without."""
    texts = [c for c in table.columns if len(table) and not pd.api.types.is_numeric_dtype(table[c])]
    first = {c: str(table[c].dropna().iloc[0]).strip() if table[c].notna().any() else "" for c in texts}
    dated, dates, of_day = ([c for c in texts if p.fullmatch(first[c])] for p in (DATED, DATE, OF_DAY))
    joined = [
        (f"{d} {t}", table[d].astype(str) + " " + table[t].astype(str)) for d in dates[:1] for t in of_day[:1]
    ]
    alone = [(str(c), table[c].astype(str)) for c in (*dated, *of_day)]
    clocks = (_from_text(column, name) for name, column in (*joined, *alone))
    return next((c for c in clocks if c is not None and np.ptp(c.ns[c.good]) > 0), None)


def _from_ticks(table: pd.DataFrame, flat: dict[str, str]) -> Clock:
    """Xsens: 10 kHz ticks that wrap at 2³² (MTi low-level protocol), and the date where it is known."""
    ticks = pd.to_numeric(table[flat["sample_time_fine"]], errors="coerce").to_numpy(float)
    good = np.isfinite(ticks)
    whole = np.where(good, ticks, 0).astype(np.int64)
    wraps = np.cumsum(np.diff(whole, prepend=whole[:1]) < -(1 << 31))
    ns = (whole + (wraps << 32)) * 100_000
    civil = [flat.get(f"utc_{part}") for part in ("year", "month", "day", "hour", "minute", "second", "nano")]
    if all(civil):
        start = _civil_ns(table, [str(c) for c in civil])
        known = good & (start > 0)
        if known.any():
            return Clock(ns + int(np.median((start - ns)[known])), good, True, flat["sample_time_fine"])
    return Clock(ns, good, False, flat["sample_time_fine"])


def _civil_ns(table: pd.DataFrame, columns: list[str]) -> Nanoseconds:
    """Nanoseconds since 1970 from columns year … second, nanosecond; 0 where there is none."""
    parts = [pd.to_numeric(table[c], errors="coerce").fillna(0).to_numpy().astype(np.int64) for c in columns]
    year, month, day, hour, minute, second, nano = parts
    known = (year > 1980) & (month >= 1) & (month <= 12)
    months = (np.where(known, year, 1970) - 1970) * 12 + np.where(known, month, 1) - 1
    days = months.astype("datetime64[M]").astype("datetime64[D]").astype(np.int64) + day - 1
    seconds = days * 86_400 + hour * 3600 + minute * 60 + second
    return np.asarray(np.where(known, seconds * _SCALE["s"] + nano, 0), np.int64)


def _from_column(column: pd.Series, name: str, unit: str) -> Clock | None:
    if pd.api.types.is_numeric_dtype(column):
        return _from_numbers(column, name, unit)
    return _from_text(column.astype(str), name)


def _from_numbers(column: pd.Series, name: str, unit: str) -> Clock:
    values = column.to_numpy()
    good = ~pd.isna(values)
    if values.dtype.kind not in "iu":
        values = column.to_numpy(float, na_value=np.nan)
        good = np.isfinite(values) & (np.abs(values) < 4e18)
    ns, known = np.zeros(len(values), np.int64), values[good]
    typical = float(np.median(np.abs(known))) if good.any() else 0.0
    if not unit and FIRST_DAY < typical < LAST_DAY and _in_days(known):
        ns[good] = _scaled(known - DAY_OF_1970, DAY_NS)
        note = f"'{name}' is taken as days since 1899-12-30, as spreadsheets count them"
        return Clock(ns, good, True, name, note)
    scale, utc = _scale(unit, typical)
    note = ""
    if not (unit or (utc and usual_step(known) * scale < RARELY_DATED_NS)):
        scale, utc, note = _since_start(known, name) or (scale, utc, note)
    ns[good] = _scaled(known, scale)
    return Clock(ns, good, utc, name, note)


def _since_start(values: NDArray[np.generic], name: str) -> tuple[int, bool, str] | None:
    """Nanoseconds per unit of times (n,) that are rare as seconds, that they are no UTC, and what is said of them.

    They stay seconds unless their column is one that counts or they were a century.
    """
    step = usual_step(values)
    fitting = smaller_units(step)
    if step < RARE or not fitting:
        return None
    counted = name == COUNTED and fitting[0] != "ms"
    if counted or np.median(values.astype(float)) > CENTURY:
        code = fitting[-1]
        return _SCALE[code], False, f"'{name}' states no unit; taken as {code} since the start from its steps"
    cure = to_be_called(step, split_unit(name)[0]).rstrip(".")
    said = f"'{name}' states no unit; taken as seconds, a row comes every {step:.3g} s. {cure}"
    return _SCALE["s"], False, said


def _in_days(values: NDArray[np.generic]) -> bool:
    """Whether numbers of the size of dates have steps far below those of the time of day in seconds."""
    steps = np.abs(np.diff(values.astype(float)))
    return bool((steps > 0.0).any() and np.median(steps[steps > 0.0]) < LONGEST_STEP)


def _scale(unit: str, typical: float) -> tuple[int, bool]:
    """Nanoseconds per unit, and whether values of that size are time since 1970."""
    for code, limit in (("s", 1e8), ("ms", 1e11), ("us", 1e14), ("ns", 1e17)):
        if limit <= typical < limit * 1e3 and unit in {"", code}:
            return _SCALE[code], True
    return _SCALE.get(unit, _SCALE["s"]), False


def _scaled(values: NDArray[np.generic], scale: int) -> Nanoseconds:
    if values.dtype.kind in "iu":
        return np.asarray(values.astype(np.int64) * scale, np.int64)
    whole = np.floor(values.astype(float))
    part = np.rint((values.astype(float) - whole) * scale)
    return np.asarray(whole.astype(np.int64) * scale + part.astype(np.int64), np.int64)


def _from_text(column: pd.Series, name: str) -> Clock | None:
    of_day = column.str.fullmatch(OF_DAY)
    if of_day.mean() > 0.5:
        times = pd.to_timedelta(column.where(of_day).str.replace(",", "."), errors="coerce")
        ns = times.astype("timedelta64[ns]").to_numpy().astype(np.int64)
        return Clock(over_midnight(ns, of_day.to_numpy(bool)), of_day.to_numpy(bool), utc=False, column=name)
    stamps = pd.to_datetime(column, format="ISO8601", utc=True, errors="coerce")
    if stamps.isna().mean() > 0.5:
        stamps = pd.to_datetime(column, format=_layout(str(column.iloc[0])), utc=True, errors="coerce")
    good = stamps.notna().to_numpy()
    if good.mean() <= 0.5:
        return None
    ns = stamps.dt.tz_localize(None).astype("datetime64[ns]").to_numpy().astype(np.int64)
    return Clock(np.where(good, ns, 0), good, utc=True, column=name)


def _layout(example: str) -> str:
    """Guess the layout of a date that is not ISO: ``31.12.2024``, ``2024/12/31``, ``12/31/2024``."""
    date = re.match(r"(\d+)([./-])(\d+)[./-](\d+)", example)
    if not date:
        return "%Y-%m-%d %H:%M:%S"
    mark = date[2]
    parts = ["%d", "%m", "%Y"] if mark != "/" or int(date[1]) > 12 else ["%m", "%d", "%Y"]
    parts = ["%Y", "%m", "%d"] if len(date[1]) == 4 else parts
    fraction = ".%f" if re.search(r":\d\d\.\d+$", example) else ""
    return mark.join(parts) + ("T" if "T" in example else " ") + "%H:%M:%S" + fraction


def over_midnight(ns: Nanoseconds, good: NDArray[np.bool_] | None = None) -> Nanoseconds:
    """Time of day, made continuous: a step back of more than half a day is the next day."""
    result = np.asarray(ns, np.int64).copy()
    chosen = np.ones(len(ns), bool) if good is None else good
    days = np.zeros(int(chosen.sum()), np.int64)
    days[1:] = np.cumsum(np.rint(-np.diff(result[chosen]) / DAY_NS).astype(np.int64))
    result[chosen] += days * DAY_NS
    return result
