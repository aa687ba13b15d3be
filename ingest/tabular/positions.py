"""Latitudes and longitudes that are no plain degrees: whole numbers of 1e-7 degrees, degrees and minutes, hemispheres.

NMEA 0183 writes ``5218.7564,N``: two digits of degrees and the minutes; receivers' own formats write 523126070.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import Finding
from ingest.tabular.naming import called_latitude_or_longitude, latitude_and_longitude
from ingest.tabular.sexagesimal import in_numbers

Floats = NDArray[np.float64]

#: Degrees at a pole, and how many of 1e-7 degrees a whole number is taken for.
POLE, TINY = 90.0, 1e7
#: A whole number beyond this many of them, degrees, is one.
LEAST_TINY = 0.1
#: Values of each hemisphere, the one that counts down last.
HEMISPHERES = (("N", "S"), ("E", "W"))


def in_degrees(
    table: pd.DataFrame, stated: Mapping[str, str]
) -> tuple[pd.DataFrame, dict[str, str], list[Finding]]:
    """A table with its positions in degrees, or with their unit.

    Parameters
    ----------
    table : DataFrame
    stated : mapping of str to str
        Units of its columns, "" where none is stated.

    Returns
    -------
    table : DataFrame
        Degrees and minutes, and what a column of hemispheres says, put into degrees with a sign.
    units : dict of str to str
        The units, with those that were found.
    findings : list of Finding
        What was made of them, or that they are no degrees.
    """
    told, units = _from_text(table), dict(stated)
    lost = sum(int((np.isnan(x) & table[c].notna()).sum()) for c, x in told.items())
    table = table.assign(**told)
    for pair in latitude_and_longitude(table, stated):
        latitude = table[pair[0]].to_numpy(float, na_value=np.nan)
        written = latitude[np.isfinite(latitude) & (latitude != 0.0)]
        typical = float(np.median(np.abs(written))) if len(written) else 0.0
        both = f"'{pair[0]}' and '{pair[1]}'"
        if LEAST_TINY * TINY < typical <= POLE * TINY and (written == np.rint(written)).all():
            note = f"{both} state no unit; taken as 1e-7 degrees from their values"
            return table, units | dict.fromkeys(pair, "degE7"), [Finding("note", note)]
        minutes = _with_minutes(written)
        if typical > POLE and not minutes:
            return table, units, [Finding("note", f"{both} are no position: {no_degrees(pair[0], written)}")]
        table, signs = _signed(table, pair, minutes)
        note = f"{both} are taken as degrees and minutes, as NMEA 0183 writes them" if minutes else ""
        note = note or (f"{both} are text, read as degrees, minutes and seconds" if pair[0] in told else "")
        note += f"; {lost} of them cannot be" if note and lost else ""
        said = [note, f"{both} have the sign that {' and '.join(signs)} say"] if signs else [note]
        return table, units, [Finding("note", text) for text in said if text]
    return table, units, []


def _from_text(table: pd.DataFrame) -> dict[str, Floats]:
    """Latitudes and longitudes that are written as text, degrees by column."""
    words = [c for c in map(str, table.columns) if not pd.api.types.is_numeric_dtype(table[c])]
    told = {c: in_numbers(table[c]) for c in words if called_latitude_or_longitude(c)}
    return {c: x for c, x in told.items() if x is not None}


def no_degrees(name: str, latitudes: Floats) -> str:
    """What is wrong with latitudes beyond the poles, and what can be done."""
    low, high = np.min(latitudes), np.max(latitudes)
    return (
        f"'{name}' goes from {low:.6g} to {high:.6g}, and degrees end at 90. If they are metres, call them north and "
        "east; if not, write degrees"
    )


def _with_minutes(values: Floats) -> bool:
    """Whether latitudes look like ddmm.mmmm: beyond 90, of at most four digits, the last two below 60."""
    size = np.abs(values)
    typical = np.median(size) if len(size) else 0.0
    return bool(POLE < typical <= 100.0 * POLE and (size % 100.0 < 60.0).all() and (size % 1.0 != 0.0).any())


def _signed(table: pd.DataFrame, pair: tuple[str, str], minutes: bool) -> tuple[pd.DataFrame, list[str]]:
    """The table with positions in degrees, and the columns that say their hemispheres."""
    columns, used = {}, []
    for name, (ahead, back) in zip(pair, HEMISPHERES, strict=True):
        value = table[name].to_numpy(float, na_value=np.nan)
        if minutes:
            size = np.abs(value)
            value = np.copysign(size // 100.0 + size % 100.0 / 60.0, value)
        side = next((str(c) for c in table.columns if _says(table[c], {ahead, back})), None)
        if side is not None:
            value = np.where(table[side].str.strip().str.upper() == back, -np.abs(value), value)
            used.append(f"'{side}'")
        columns[name] = value
    return (table.assign(**columns) if minutes or used else table), used


def _says(column: pd.Series, letters: set[str]) -> bool:
    """Whether a column holds nothing but these letters."""
    if pd.api.types.is_numeric_dtype(column):
        return False
    found = {str(value).strip().upper() for value in column.dropna().unique()[:9]}
    return bool(found) and found <= letters
