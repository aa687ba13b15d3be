# ruff: noqa: SIM109 - numba compiles plain comparisons best
"""Compiled scanner for candump's log style: ``(1502984866.421964) can0 09F112CC#FF725AFF7FFF7FFD``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import int64
from numpy.typing import NDArray

from ingest.compiled import compiled
from ingest.hexadecimal import hex_digit

#: Kinds of record. A doubtful frame is not followed by a line end: by another, by junk, or by the end of the file.
NOTHING, FRAME, DOUBTFUL, OTHER = 0, 1, 2, 3
NEWLINE, RETURN, SPACE, TAB, HASH, OPEN, CLOSE, POINT = 10, 13, 32, 9, 35, 40, 41, 46
MOST_CHANNELS = 64
LONGEST_NAME = 16
#: Room for damaged stretches to begin with.
FEW = 4096


@compiled
def read_stamp(text: NDArray[np.uint8], i: int) -> tuple[int, int]:
    """Nanoseconds of ``(seconds.fraction)`` at ``i``, and where it ends (−1: not a stamp)."""
    n = len(text)
    seconds, digits = 0, 0
    i += 1
    while i < n and 48 <= text[i] <= 57 and digits < 11:
        seconds = seconds * 10 + text[i] - 48
        digits += 1
        i += 1
    if digits == 0 or digits > 10 or i >= n or text[i] != POINT:
        return 0, -1
    i += 1
    unit, nano = 100_000_000, 0
    start = i
    while i < n and 48 <= text[i] <= 57 and i - start < 10:
        nano += (text[i] - 48) * unit
        unit //= 10
        i += 1
    if i == start or i >= n or text[i] != CLOSE or seconds > 9_000_000_000:
        return 0, -1
    return seconds * 1_000_000_000 + nano, i + 1


@compiled
def skip_blanks(text: NDArray[np.uint8], i: int) -> int:
    """First place from ``i`` on that is neither space nor tab."""
    while i < len(text) and (text[i] == SPACE or text[i] == TAB):
        i += 1
    return i


@compiled
def read_name(text: NDArray[np.uint8], i: int) -> int:
    """Where the name of an interface that starts at ``i`` ends (−1: no name)."""
    start = i
    while i < len(text) and i - start <= LONGEST_NAME:
        c = text[i]
        if c == SPACE or c == TAB:
            break
        if c < 33 or c > 126 or c == HASH or c == OPEN or c == CLOSE:
            return -1
        i += 1
    return i if start < i <= start + LONGEST_NAME and i < len(text) else -1


@compiled
def read_id(text: NDArray[np.uint8], i: int) -> tuple[int, int, int]:
    """Identifier at ``i``, number of its digits, place after the ``#`` (−1: no identifier)."""
    value, digits = 0, 0
    while i < len(text) and digits < 9:
        d = hex_digit(text[i])
        if d < 0:
            break
        value = value * 16 + d
        digits += 1
        i += 1
    if (digits != 3 and digits != 8) or i >= len(text) or text[i] != HASH:
        return 0, 0, -1
    return value, digits, i + 1


@compiled
def read_data(text: NDArray[np.uint8], i: int, out: NDArray[np.uint8]) -> tuple[int, int]:
    """Data bytes at ``i`` into ``out``: how many (−1: not whole bytes, or too many), and where they end."""
    count = 0
    n = len(text)
    for k in range(8):
        out[k] = 0
    while i < n:
        high = hex_digit(text[i])
        if high < 0:
            break
        low = hex_digit(text[i + 1]) if i + 1 < n else -1
        if low < 0 or count == 8:
            return -1, i
        out[count] = high * 16 + low
        count += 1
        i += 2
    return count, i


@compiled
def line_end(text: NDArray[np.uint8], i: int) -> tuple[int, int]:
    """What follows a record: (kind, where the record ends)."""
    n = len(text)
    j = skip_blanks(text, i)
    if j < n and j > i and (text[j] == 82 or text[j] == 84):  # the direction, R or T
        j = skip_blanks(text, j + 1)
    if j < n and text[j] == RETURN:
        j += 1
    if j >= n:
        return DOUBTFUL, n
    if text[j] == NEWLINE:
        return FRAME, j + 1
    if text[j] == OPEN:
        return DOUBTFUL, j
    return (DOUBTFUL, i) if hex_digit(text[i]) < 0 else (NOTHING, i)


@compiled
def skip_other(text: NDArray[np.uint8], i: int) -> int:
    """End of the line of a remote or CAN FD frame whose text starts at ``i`` (−1: it is neither)."""
    c = text[i] if i < len(text) else 0
    if c != HASH and c != 82:
        return -1
    i += 1
    while i < len(text) and hex_digit(text[i]) >= 0:
        i += 1
    kind, end = line_end(text, i)
    return end if kind != NOTHING else -1


@compiled
def channel_index(
    text: NDArray[np.uint8], start: int, end: int, names: NDArray[np.int64], count: int
) -> tuple[int, int]:
    """Index of an interface's name among those seen, and how many have been seen."""
    length = end - start
    for k in range(count):
        if names[k, 1] - names[k, 0] != length:
            continue
        same = True
        for j in range(length):
            if text[names[k, 0] + j] != text[start + j]:
                same = False
                break
        if same:
            return k, count
    if count == len(names):
        return count - 1, count
    names[count, 0], names[count, 1] = start, end
    return count, count + 1


@compiled
def idle_line(text: NDArray[np.uint8], i: int, at_start: bool) -> int:
    """End of the blank stretch or comment line at ``i``; ``i`` itself if there is none."""
    n = len(text)
    c = text[i]
    if c == NEWLINE or c == RETURN or c == SPACE or c == TAB:
        return i + 1
    if c != HASH or not at_start:
        return i
    while i < n and text[i] != NEWLINE:
        if text[i] < 9:
            return i
        i += 1
    return min(i + 1, n)


@compiled
def read_record(
    text: NDArray[np.uint8], i: int, data: NDArray[np.uint8]
) -> tuple[int, int, int, int, int, int, int, int]:
    """The record at ``i``: kind, end, stamp, identifier, its digits, bytes, start and end of the name."""
    stamp, j = read_stamp(text, i)
    if j < 0:
        return NOTHING, i, 0, 0, 0, 0, 0, 0
    name_start = skip_blanks(text, j)
    name_end = read_name(text, name_start)
    if name_start == j or name_end < 0:
        return NOTHING, i, 0, 0, 0, 0, 0, 0
    identifier, digits, j = read_id(text, skip_blanks(text, name_end))
    if j < 0:
        return NOTHING, i, 0, 0, 0, 0, 0, 0
    end = skip_other(text, j)
    if end > 0:
        return OTHER, end, 0, 0, 0, 0, 0, 0
    size, j = read_data(text, j, data)
    kind, end = line_end(text, j)
    if size < 0 or kind == NOTHING:
        return NOTHING, i, 0, 0, 0, 0, 0, 0
    if identifier >= 0x2000_0000:  # an error frame
        kind = OTHER
    return kind, end, stamp, identifier, digits, size, name_start, name_end


def scan(text: NDArray[np.uint8]) -> tuple[Any, ...]:
    """Every record of the log style in ``text``.

    Returns
    -------
    time_ns, can_id, extended, channel, dlc, data, doubtful, spans, names, damaged : arrays
        ``spans`` and ``damaged`` hold start and end of each doubtful record and of each damaged stretch,
        ``names`` those of each interface's name.
    other : int
        Number of remote, error and CAN FD frames.
    """
    most = int(np.count_nonzero(text == OPEN)) + 1
    columns = (
        np.empty(most, np.int64), np.empty(most, np.uint32), np.empty(most, np.bool_), np.empty(most, np.int16),
        np.empty(most, np.uint8), np.empty((most, 8), np.uint8), np.empty(most, np.bool_),
    )  # fmt: skip
    names, room = np.empty((MOST_CHANNELS, 2), np.int64), FEW
    while True:
        spans, damaged = np.empty((room, 2), np.int64), np.empty((room, 2), np.int64)
        count, doubts, channels, holes, other = fill(text, *columns, spans, names, damaged)
        if max(doubts, holes) <= room:
            break
        room = max(doubts, holes)
    return (*(c[:count] for c in columns), spans[:doubts], names[:channels], damaged[:holes], int(other))


@compiled
def noted(spans: NDArray[np.int64], count: int, start: int, end: int) -> int:
    """Put a span at place ``count`` if there is room; the next place."""
    if count < len(spans):
        spans[count, 0], spans[count, 1] = start, end
    return count + 1


@compiled
def fill(
    text: NDArray[np.uint8],
    time_ns: NDArray[np.int64],
    can_id: NDArray[np.uint32],
    extended: NDArray[np.bool_],
    channel: NDArray[np.int16],
    dlc: NDArray[np.uint8],
    data: NDArray[np.uint8],
    doubtful: NDArray[np.bool_],
    spans: NDArray[np.int64],
    names: NDArray[np.int64],
    damaged: NDArray[np.int64],
) -> tuple[int, int, int, int, int]:
    """Fill the columns; numbers of records, doubtful ones, channels, damaged stretches and other frames."""
    zero = int64(0)  # a plain 0 would compile all that follows for that constant too
    n, i, k, channels, doubts, holes, other = len(text), zero, zero, zero, zero, zero, zero
    bad = zero - 1  # where the damaged stretch that is under way began
    while i < n:
        kind, end = NOTHING, i
        if text[i] == OPEN:
            kind, end, stamp, identifier, digits, size, name_start, name_end = read_record(text, i, data[k])
        else:
            end = idle_line(text, i, i == 0 or text[i - 1] == NEWLINE)
        if end == i:  # neither a record nor blank
            bad = i if bad < 0 else bad
            i += 1
            continue
        if bad >= 0 and (kind != NOTHING or text[i] == NEWLINE):
            holes = noted(damaged, holes, bad, i)
            bad = zero - 1
        if kind == OTHER:
            other += 1
        elif kind != NOTHING:
            time_ns[k], can_id[k], extended[k] = stamp, identifier, digits == 8
            dlc[k], doubtful[k] = size, kind == DOUBTFUL
            if kind == DOUBTFUL:
                doubts = noted(spans, doubts, i, end)
            channel[k], channels = channel_index(text, name_start, name_end, names, channels)
            k += 1
        i = end
    if bad >= 0:
        holes = noted(damaged, holes, bad, n)
    return k, doubts, channels, holes, other
