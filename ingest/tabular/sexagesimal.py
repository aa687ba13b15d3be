"""Latitudes and longitudes written as text: degrees, minutes and seconds with a hemisphere, as plotters export."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Hemisphere, degrees, minutes, seconds, hemisphere.
WRITTEN = re.compile(
    r"\s*(?P<before>[NSEW]?)\s*(?P<sign>[+-]?)(?P<degrees>\d{1,3}(?:\.\d+)?)\s*[°º]?"
    r"(?:[\s:]*(?P<minutes>\d{1,2}(?:\.\d+)?)\s*['′’]?(?:[\s:]*(?P<seconds>\d{1,2}(?:\.\d+)?)\s*(?:\"|″|”|''|’’)?)?)?"
    r"\s*(?P<after>[NSEW]?)\s*"
)


def is_written(field: str) -> bool:
    """Whether a field is a latitude or a longitude that no number says: it has a hemisphere or a degree sign."""
    found = WRITTEN.fullmatch(field)
    return found is not None and bool(found["before"] or found["after"] or "°" in field or "º" in field)


def in_numbers(column: pd.Series) -> Floats | None:
    """Degrees (n,), NaN where nothing is written or what cannot be read; None where that is most of it."""
    text = column.astype("string").str.strip()
    there = text.notna() & (text != "")
    known = text[there].unique().tolist()
    if sum(map(is_written, known[:100])) <= 0.5 * len(known[:100]):
        return None
    part = text.str.extract(f"^{WRITTEN.pattern}$")
    degrees, minutes, seconds = (
        pd.to_numeric(part[name], errors="coerce").to_numpy(float, na_value=np.nan)
        for name in ("degrees", "minutes", "seconds")
    )
    size = degrees + np.nan_to_num(minutes) / 60.0 + np.nan_to_num(seconds) / 3600.0
    side = part["before"].fillna("") + part["after"].fillna("")
    back = side.isin(["S", "W"]) ^ (part["sign"] == "-")
    return np.asarray(np.where(back.fillna(False).to_numpy(bool), -size, size), float)
