"""The comma-separated fields of many sentences at once: split, and parsed column by column."""

from __future__ import annotations

from typing import cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.compiled import compiled
from ingest.marine.scan import Bytes
from ingest.marine.stamps import days_from_civil

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: "No value" in the integer columns of times and dates.
MISSING = -1
_COMMA, _STAR, _DOT = 44, 42, 46
#: Mantissas up to here, and powers of ten up to 10²², are exact in binary64, and so is their quotient's
#: rounding.
_EXACT = 1 << 53


@compiled
def pack(data: Bytes, a: Integers, b: Integers, longest: int = 8) -> Integers:
    """Texts from each ``a`` up to a comma, a star or ``b``, as one integer each; longer than eight: 0."""
    keys = np.zeros(len(a), np.int64)
    for i in range(len(a)):
        key, p = 0, a[i]
        while p < b[i] and data[p] != _COMMA and data[p] != _STAR:
            key = (key << 7) | (data[p] & 127)
            p += 1
        keys[i] = key if p - a[i] <= longest else 0
    return keys


def unpack(key: int) -> str:
    """Return the text of a packed key."""
    text = ""
    while key:
        text, key = chr(key & 127) + text, key >> 7
    return text


@compiled
def count_fields(data: Bytes, a: Integers, b: Integers) -> Integers:
    """Return number of fields after the address of each sentence."""
    counts = np.zeros(len(a), np.int64)
    for i in range(len(a)):
        for p in range(a[i], b[i]):
            if data[p] == _COMMA:
                counts[i] += 1
            elif data[p] == _STAR:
                break
    return counts


@compiled
def split(data: Bytes, a: Integers, b: Integers, fields: int) -> Integers:
    """Where each field begins; the last row is one after the end of the last field. (fields + 1, n)."""
    marks = np.zeros((fields + 1, len(a)), np.int64)
    for i in range(len(a)):
        k, p = 0, a[i]
        while p < b[i] and data[p] != _STAR:
            if data[p] == _COMMA and k <= fields:
                marks[k, i] = p + 1
                k += 1
            p += 1
        for j in range(k, fields + 1):
            marks[j, i] = p + 1
    return marks


def decimals(data: Bytes, a: Integers, b: Integers) -> Floats:
    """Numbers, correctly rounded; NaN where a field is empty or none. Fields are ``data[a:b]``."""
    values, odd = _decimals(data, a, b)
    for i in np.flatnonzero(odd):
        values[i] = _any_number(bytes(data[a[i] : b[i]]))
    return values


def _any_number(text: bytes) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


@compiled
def _decimals(data: Bytes, a: Integers, b: Integers) -> tuple[Floats, Flags]:
    values, odd = np.full(len(a), np.nan), np.zeros(len(a), np.bool_)
    for i in range(len(a)):
        if b[i] > a[i]:
            mantissa, places, ok = _mantissa(data, a[i], b[i])
            if ok:
                values[i] = mantissa / 10.0**places
                if mantissa == 0 and data[a[i]] == 45:
                    values[i] = -0.0
            else:
                odd[i] = True
    return values, odd


@compiled
def _mantissa(data: Bytes, p: int, b: int) -> tuple[int, int, bool]:
    """``±123.456`` as 123456 and 3; false where it is something else, or too long to be exact."""
    sign, value, places, dotted, digits = 1, 0, 0, False, 0
    if data[p] == 45 or data[p] == 43:
        sign = -1 if data[p] == 45 else 1
        p += 1
    while p < b:
        c = data[p]
        if 48 <= c <= 57:
            value = value * 10 + (c - 48)
            digits += 1
            places += dotted
            if value > _EXACT or places > 22:
                return 0, 0, False
        elif c == _DOT and not dotted:
            dotted = True
        else:
            return 0, 0, False
        p += 1
    return sign * value, places, digits > 0


@compiled
def degrees(data: Bytes, a: Integers, b: Integers, side: Bytes) -> Floats:
    """``dddmm.mmmm`` as signed degrees; ``side`` (n,) holds N, S, E or W."""
    values = np.full(len(a), np.nan)
    for i in range(len(a)):
        if b[i] - a[i] < 3:
            continue
        mantissa, places, ok = _mantissa(data, a[i], b[i])
        if ok and places <= 12:
            unit = 10**places
            whole = mantissa // (100 * unit)
            minutes = (mantissa - whole * 100 * unit) / 10.0**places
            value = whole + minutes / 60.0
            values[i] = -value if side[i] == 83 or side[i] == 87 else value
    return values


@compiled
def times_of_day(data: Bytes, a: Integers, b: Integers) -> Integers:
    """``hhmmss[.sss]`` as nanoseconds of the day, ``MISSING`` where there is none."""
    values = np.full(len(a), MISSING, np.int64)
    for i in range(len(a)):
        mantissa, places, ok = _mantissa(data, a[i], b[i]) if b[i] - a[i] >= 6 else (0, 0, False)
        if not ok or places > 9 or mantissa < 0:
            continue
        whole = mantissa // 10**places
        part = (mantissa - whole * 10**places) * 10 ** (9 - places)
        hours, minutes, seconds = whole // 10000, whole // 100 % 100, whole % 100
        if hours < 24 and minutes < 60 and seconds <= 60:
            values[i] = ((hours * 60 + minutes) * 60 + seconds) * 1_000_000_000 + part
    return values


@compiled
def dates(data: Bytes, a: Integers, b: Integers, month_first: bool, long_year: bool) -> Integers:
    """``ddmmyy`` (or ``mmddyy``, ``ddmmyyyy``) as days since 1970, ``MISSING`` where there is none."""
    values = np.full(len(a), MISSING, np.int64)
    for i in range(len(a)):
        mantissa, places, ok = _mantissa(data, a[i], b[i]) if b[i] > a[i] else (0, 0, False)
        if not ok or places or b[i] - a[i] != (8 if long_year else 6):
            continue
        span = 10000 if long_year else 100
        first, second, year = mantissa // span // 100, mantissa // span % 100, mantissa % span
        if not long_year:
            year += 1900 if year >= 69 else 2000
        day, month = (second, first) if month_first else (first, second)
        if 1 <= month <= 12 and 1 <= day <= 31:
            values[i] = days_from_civil(year, month, day)
    return values


@compiled
def first_letters(data: Bytes, a: Integers, b: Integers) -> Bytes:
    """First character of each field, 0 where it is empty."""
    letters = np.zeros(len(a), np.uint8)
    for i in range(len(a)):
        if b[i] > a[i]:
            letters[i] = data[a[i]]
    return letters


def texts(data: Bytes, a: Integers, b: Integers) -> pd.Categorical:
    """Texts as categories; missing where a field is empty."""
    width = int((b - a).max(initial=0))
    if width <= 8:
        keys = pack(data, a, b)
        codes, known = pd.factorize(keys, sort=False)
        names = [unpack(int(k)) for k in known]
    else:
        cells = _gather(data, a, b, width).view(f"S{width}").ravel()
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
def _gather(data: Bytes, a: Integers, b: Integers, width: int) -> NDArray[np.uint8]:
    cells = np.zeros((len(a), width), np.uint8)
    for i in range(len(a)):
        for j in range(b[i] - a[i]):
            cells[i, j] = data[a[i] + j]
    return cells
