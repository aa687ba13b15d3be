"""Time stamps that a host wrote before each record: ISO, epoch, time of day, milliseconds, TAG blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ingest.compiled import compiled
from ingest.hexadecimal import hex_digit
from ingest.log import Finding
from ingest.marine.scan import Bytes, Records
from ingest.wrong_stamps import wrong_stamps

Integers = NDArray[np.int64]

#: Styles of stamp.
NONE, ISO, OF_DAY, DECIMAL, INTEGER, TAG = 0, 1, 2, 3, 4, 5
SECOND, DAY = 1_000_000_000, 86_400_000_000_000
#: A number above this many seconds is time since 1970.
EPOCH = 100_000_000
_BACKSLASH, _DOT, _COLON, _STAR = 92, 46, 58, 42


@dataclass(frozen=True)
class Stamps:
    """Host times of records.

    Attributes
    ----------
    ns : (n,) int64
        Nanoseconds; only where ``good``.
    good : (n,) bool
        Records that have a stamp of their own.
    utc : bool
        Whether they are UTC (of the host's clock).
    findings : tuple of Finding
        What was odd about them.
    """

    ns: Integers
    good: NDArray[np.bool_]
    utc: bool
    findings: tuple[Finding, ...] = ()


def host_stamps(data: Bytes, records: Records) -> Stamps | None:
    """Stamps before the records of a stream; None where fewer than half of the lines have one."""
    if not (records.prefix < records.start).any():
        return None
    parsed = np.zeros((4, len(records.start)), np.int64)
    _parse_all(data, records.prefix, records.start, parsed)
    style, whole, fraction, digits = parsed
    counts = np.bincount(style, minlength=TAG + 1)
    counts[NONE] = 0
    main = int(counts.argmax())
    good = style == main
    if main == NONE or good.sum() * 2 < (records.kind <= 1).sum():
        return None
    ns, utc, findings = _nanoseconds(main, whole, fraction, digits, good)
    other = int(((style != main) & (records.prefix < records.start)).sum())
    if other:
        text = f"{other} lines have another text than a time stamp before the record"
        findings.append(Finding("note", text, count=other))
    wrong = np.flatnonzero(good)[wrong_stamps(ns[good])]
    if len(wrong):
        text = f"{len(wrong)} time stamps that their neighbours contradict; their records are timed by these"
        findings.append(Finding("clock", text, count=len(wrong)))
        good[wrong] = False
    return Stamps(ns, good, utc, tuple(findings))


def _nanoseconds(
    style: int, whole: Integers, fraction: Integers, digits: Integers, good: NDArray[np.bool_]
) -> tuple[Integers, bool, list[Finding]]:
    if style in (ISO, OF_DAY, DECIMAL):
        padded, findings = _fractions(whole, fraction, digits, good)
        ns = whole * SECOND + padded
        if style == OF_DAY:
            ns = _over_midnight(ns, good)
        return ns, style == ISO or bool(np.median(whole[good]) > EPOCH), findings
    typical = float(np.median(whole[good]))
    for scale, limit in ((SECOND, EPOCH), (1_000_000, 1e11), (1_000, 1e14), (1, 1e17)):
        if limit <= typical < limit * 1e3:
            return whole * scale, True, []
    return whole * (SECOND if style == TAG else 1_000_000), False, []


def _over_midnight(ns: Integers, good: NDArray[np.bool_]) -> Integers:
    result = ns.copy()
    days = np.rint(-np.diff(ns[good], prepend=ns[good][:1]) / DAY).astype(np.int64)
    result[good] += np.cumsum(days) * DAY
    return result


def _fractions(
    whole: Integers, fraction: Integers, digits: Integers, good: NDArray[np.bool_]
) -> tuple[Integers, list[Finding]]:
    """Nanoseconds of the fraction of a second; where a logger dropped its leading zeros, they are put back.

    A logger that prints seconds and nanoseconds (or milli-, microseconds) with a dot between them writes 7.045 s as
    ``7.45``. It is recognised by fractions of different lengths of which none starts with a zero although some are
    short, and by a clock that runs back as read but not with the zeros put back.
    """
    plain = fraction * 10 ** np.clip(9 - digits, 0, 9)
    longest = int(digits[good].max(initial=0))
    if (digits[good] == longest).all():
        return plain, []
    mended = fraction * 10 ** (9 - longest)
    back, back_mended = _steps_back(whole, plain, good), _steps_back(whole, mended, good)
    if back and back_mended * 4 < back:
        short = int((digits[good] < longest).sum())
        text = f"{short} time stamps had lost the leading zeros of their fraction; put back"
        return mended, [Finding("clock", text, count=short)]
    return plain, []


def _steps_back(whole: Integers, fraction: Integers, good: NDArray[np.bool_]) -> int:
    return int((np.diff((whole * SECOND + fraction)[good]) < 0).sum())


@compiled
def _parse_all(data: Bytes, a: Integers, b: Integers, out: Integers) -> None:
    for i in range(len(a)):
        if b[i] > a[i]:
            out[0, i], out[1, i], out[2, i], out[3, i] = _parse(data, a[i], b[i])


@compiled
def _number(data: Bytes, p: int, b: int) -> tuple[int, int]:
    """Return the digits from ``p`` on: their value and where they end."""
    value = 0
    while p < b and 48 <= data[p] <= 57 and value < 10**17:
        value = value * 10 + (data[p] - 48)
        p += 1
    return value, p


@compiled
def _parse(data: Bytes, a: int, b: int) -> tuple[int, int, int, int]:
    """Style, whole seconds (or the number), fraction and its number of digits."""
    p = a
    while p < b and not 48 <= data[p] <= 57:
        if data[p] == _BACKSLASH:
            return _parse_tag(data, p, b)
        if 65 <= (data[p] & 0xDF) <= 90:
            while p + 1 < b and (48 <= data[p + 1] <= 57 or 65 <= (data[p + 1] & 0xDF) <= 90):
                p += 1
        p += 1
    first, q = _number(data, p, b)
    if q == p:
        return NONE, 0, 0, 0
    mark = data[q] if q < b else 0
    if q - p == 4 and (mark == 45 or mark == 47):
        return _parse_iso(data, first, q, b)
    if q - p <= 2 and mark == _COLON:
        return _parse_clock(data, p, b, OF_DAY, 0)
    if mark == _DOT and q + 1 < b and 48 <= data[q + 1] <= 57:
        part, end = _number(data, q + 1, min(b, q + 10))
        return DECIMAL, first, part, end - q - 1
    return INTEGER, first, 0, 0


@compiled
def _parse_iso(data: Bytes, year: int, q: int, b: int) -> tuple[int, int, int, int]:
    month, q = _number(data, q + 1, b)
    day, q = _number(data, q + 1, b)
    if not (1 <= month <= 12 and 1 <= day <= 31 and q < b):
        return NONE, 0, 0, 0
    return _parse_clock(data, q + 1, b, ISO, days_from_civil(year, month, day) * 86400)


@compiled
def _parse_clock(data: Bytes, p: int, b: int, style: int, base: int) -> tuple[int, int, int, int]:
    """``hh:mm[:ss[.fraction]][Z|±hh[:]mm]`` added to ``base`` seconds."""
    hours, q = _number(data, p, b)
    minutes, q = _number(data, q + 1, b)
    seconds, part, digits = 0, 0, 0
    if q < b and data[q] == _COLON:
        seconds, q = _number(data, q + 1, b)
        if q + 1 < b and (data[q] == _DOT or data[q] == 44) and 48 <= data[q + 1] <= 57:
            part, end = _number(data, q + 1, min(b, q + 10))
            digits = end - q - 1
            q = end
            while q < b and 48 <= data[q] <= 57:
                q += 1
    if hours > 24 or minutes > 59 or seconds > 60:
        return NONE, 0, 0, 0
    zone = 0
    if style == ISO and q + 2 < b and (data[q] == 43 or data[q] == 45) and 48 <= data[q + 1] <= 57:
        sign = 1 if data[q] == 43 else -1
        zone_hours, end = _number(data, q + 1, q + 3)
        zone_minutes, _ = _number(data, end + 1 if end < b and data[end] == _COLON else end, b)
        zone = sign * (zone_hours * 3600 + zone_minutes * 60)
    return style, base + hours * 3600 + minutes * 60 + seconds - zone, part, digits


@compiled
def _parse_tag(data: Bytes, p: int, b: int) -> tuple[int, int, int, int]:
    r"""Return the ``c:`` field of a TAG block ``\s:…,c:1241544035*4A\``, if its checksum is right."""
    xor, value = 0, -1
    for q in range(p + 1, b):
        if data[q] == _STAR:
            high, low = (hex_digit(data[q + 1]), hex_digit(data[q + 2])) if q + 2 < b else (-1, -1)
            right = high >= 0 and low >= 0 and high * 16 + low == xor
            return (TAG, value, 0, 0) if right and value >= 0 else (NONE, 0, 0, 0)
        if data[q] == 99 and q + 2 < b and data[q + 1] == _COLON and (data[q - 1] == 44 or q == p + 1):
            value, _ = _number(data, q + 2, b)
        xor ^= data[q]
    return NONE, 0, 0, 0


@compiled
def days_from_civil(year: int, month: int, day: int) -> int:
    """Days from 1970-01-01 to a date of the Gregorian calendar (Hinnant 2013, chrono algorithms)."""
    y = year - 1 if month <= 2 else year
    era = y // 400
    of_era = y - era * 400
    of_year = (153 * (month + (-3 if month > 2 else 9)) + 2) // 5 + day - 1
    return era * 146097 + of_era * 365 + of_era // 4 - of_era // 100 + of_year - 719468
