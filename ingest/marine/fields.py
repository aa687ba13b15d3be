"""The comma-separated fields of many sentences at once: split, and parsed column by column."""

from __future__ import annotations

from typing import cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.compiled import compiled
from ingest.marine.scan import Bytes

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: "No value" in the integer columns of times and dates.
MISSING = -1
_COMMA, _STAR, _DOT, _MINUS, _PLUS = 44, 42, 46, 45, 43
#: Mantissas up to here, and powers of ten up to 10²², are exact in binary64, and so is their quotient's
#: rounding.
_EXACT = 1 << 53
MOST_PLACES = 22
TENS = 10.0 ** np.arange(MOST_PLACES + 1)
WHOLE_TENS = 10 ** np.arange(13, dtype=np.int64)


def pack(data: Bytes, a: Integers, b: Integers, longest: int = 8) -> Integers:
    """Texts from each ``a`` up to a comma, a star or ``b``, as one integer each; longer than eight: 0."""
    keys = np.empty(len(a), np.int64)
    _pack(data, a, b, longest, keys)
    return keys


@compiled
def _pack(data: Bytes, a: Integers, b: Integers, longest: int, keys: Integers) -> None:
    for i in range(len(a)):
        key, p = 0, a[i]
        while p < b[i] and data[p] != _COMMA and data[p] != _STAR:
            key = (key << 7) | (data[p] & 127)
            p += 1
        keys[i] = key if p - a[i] <= longest else 0


def unpack(key: int) -> str:
    """Return the text of a packed key."""
    text = ""
    while key:
        text, key = chr(key & 127) + text, key >> 7
    return text


def count_fields(data: Bytes, a: Integers, b: Integers) -> Integers:
    """Return number of fields after the address of each sentence."""
    counts = np.zeros(len(a), np.int64)
    _mark(data, a, b, counts, np.empty((0, 0), np.int64))
    return counts


def split(data: Bytes, a: Integers, b: Integers, fields: int) -> Integers:
    """Where each field begins; the last row is one after the end of the last field. (fields + 1, n)."""
    marks = np.empty((fields + 1, len(a)), np.int64)
    _mark(data, a, b, np.zeros(len(a), np.int64), marks)
    return marks


@compiled
def _mark(data: Bytes, a: Integers, b: Integers, counts: Integers, marks: Integers) -> None:
    """Count the commas of each sentence, and note where the fields after them begin as far as there is room."""
    room = marks.shape[0]
    for i in range(len(a)):
        k, p = 0, a[i]
        while p < b[i] and data[p] != _STAR:
            if data[p] == _COMMA:
                if k < room:
                    marks[k, i] = p + 1
                k += 1
            p += 1
        counts[i] = k
        for j in range(k, room):
            marks[j, i] = p + 1


def decimals(data: Bytes, a: Integers, b: Integers) -> Floats:
    """Numbers, correctly rounded; NaN where a field is empty or none. Fields are ``data[a:b]``."""
    mantissa, places = numerals(data, a, b)
    values = np.full(len(a), np.nan)
    good = places >= 0
    values[good] = mantissa[good] / TENS[places[good]]
    zero = np.flatnonzero(good & (mantissa == 0))
    values[zero[data[a[zero]] == _MINUS]] = -0.0
    for i in np.flatnonzero(~good & (b > a)):
        values[i] = _any_number(bytes(data[a[i] : b[i]]))
    return values


def _any_number(text: bytes) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def numerals(data: Bytes, a: Integers, b: Integers) -> tuple[Integers, Integers]:
    """``±123.456`` as 123456 and 3; −1 places where it is something else, or too long to be exact. (n,) each."""
    mantissa, places = np.empty(len(a), np.int64), np.empty(len(a), np.int64)
    _numerals(data, a, b, mantissa, places)
    return mantissa, places


@compiled
def _numerals(data: Bytes, a: Integers, b: Integers, mantissa: Integers, places: Integers) -> None:
    for i in range(len(a)):
        p, stop = a[i], b[i]
        negative = p < stop and data[p] == _MINUS
        if p < stop and (negative or data[p] == _PLUS):
            p += 1
        value, fraction, digits, good = 0, 0, 0, True
        dotted = 0
        while p < stop and good:
            c = data[p]
            if 48 <= c <= 57:
                value = value * 10 + (c - 48)
                digits += 1
                fraction += dotted
                good = value <= _EXACT and fraction <= MOST_PLACES
            elif c == _DOT and dotted == 0:
                dotted = 1
            else:
                good = False
            p += 1
        good = good and digits > 0
        mantissa[i] = (-value if negative else value) if good else 0
        places[i] = fraction if good else -1


def degrees(data: Bytes, a: Integers, b: Integers, side: Bytes) -> Floats:
    """``dddmm.mmmm`` as signed degrees; ``side`` (n,) holds N, S, E or W."""
    mantissa, places = numerals(data, a, b)
    good = (b - a >= 3) & (places >= 0) & (places <= 12)
    unit = WHOLE_TENS[np.where(good, places, 0)]
    whole = mantissa // (100 * unit)
    minutes = (mantissa - whole * 100 * unit) / unit.astype(float)
    value = whole + minutes / 60.0
    south_or_west = (side == ord("S")) | (side == ord("W"))
    return np.where(good, np.where(south_or_west, -value, value), np.nan)


def times_of_day(data: Bytes, a: Integers, b: Integers) -> Integers:
    """``hhmmss[.sss]`` as nanoseconds of the day, ``MISSING`` where there is none."""
    mantissa, places = numerals(data, a, b)
    good = (b - a >= 6) & (places >= 0) & (places <= 9) & (mantissa >= 0)
    unit = WHOLE_TENS[np.where(good, places, 0)]
    whole = mantissa // unit
    part = (mantissa - whole * unit) * (1_000_000_000 // unit)
    hours, minutes, seconds = whole // 10000, whole // 100 % 100, whole % 100
    good &= (hours < 24) & (minutes < 60) & (seconds <= 60)
    ns = ((hours * 60 + minutes) * 60 + seconds) * 1_000_000_000 + part
    return np.where(good, ns, MISSING)


def dates(data: Bytes, a: Integers, b: Integers, month_first: bool, long_year: bool) -> Integers:
    """``ddmmyy`` (or ``mmddyy``, ``ddmmyyyy``) as days since 1970, ``MISSING`` where there is none."""
    mantissa, places = numerals(data, a, b)
    good = (places == 0) & (b - a == (8 if long_year else 6)) & (mantissa >= 0)
    span = 10000 if long_year else 100
    first, second, year = mantissa // span // 100, mantissa // span % 100, mantissa % span
    if not long_year:
        year = year + np.where(year >= 69, 1900, 2000)
    day, month = (second, first) if month_first else (first, second)
    good &= (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)
    months = np.where(good, (year - 1970) * 12 + month - 1, 0)
    days = months.astype("datetime64[M]").astype("datetime64[D]").astype(np.int64) + day - 1
    return np.where(good, days, MISSING)


def first_letters(data: Bytes, a: Integers, b: Integers) -> Bytes:
    """First character of each field, 0 where it is empty."""
    filled = b > a
    return np.where(filled, data[np.where(filled, a, 0)], 0).astype(np.uint8)


def texts(data: Bytes, a: Integers, b: Integers) -> pd.Categorical:
    """Texts as categories; missing where a field is empty."""
    width = int((b - a).max(initial=0))
    if width <= 8:
        keys = pack(data, a, b)
        codes, known = pd.factorize(keys, sort=False)
        names = [unpack(int(k)) for k in known]
    else:
        block = np.zeros((len(a), width), np.uint8)
        _gather(data, a, b, block)
        cells = block.view(f"S{width}").ravel()
        codes, known = pd.factorize(cells.astype(object), sort=False)
        names = [bytes(k).decode("latin-1") for k in known]
    return _categories(np.asarray(codes), names)


def _categories(codes: NDArray[np.intp], names: list[str]) -> pd.Categorical:
    kept = sorted({n for n in names if n})
    place = {n: i for i, n in enumerate(kept)}
    table = np.array([place.get(n, -1) for n in names] or [-1], np.intp)
    return categorical(table[codes], kept)


def categorical(codes: NDArray[np.intp], names: list[str]) -> pd.Categorical:
    """Texts by their number among ``names``; −1 is missing."""
    kind = pd.CategoricalDtype(pd.Index(names, dtype=object))
    return cast("pd.Categorical", pd.Categorical.from_codes(codes, dtype=kind))


@compiled
def _gather(data: Bytes, a: Integers, b: Integers, cells: Bytes) -> None:
    for i in range(len(a)):
        for j in range(b[i] - a[i]):
            cells[i, j] = data[a[i] + j]
