"""Compiled search for the messages in a run of MCAP records.

A record is an opcode (1 byte), a length (8 bytes) and a content of that length.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ingest.compiled import compiled

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]

SCHEMA, CHANNEL, MESSAGE = 0x03, 0x04, 0x05
LAST_OPCODE = 0x0F
PREFIX = 9
#: A message: channel (2), sequence (4), log time (8), publish time (8).
MESSAGE_HEAD = 22
HOUR_NS = 3_600_000_000_000


@compiled
def length_at(data: Bytes, p: int) -> int:
    """Return the eight bytes at ``p`` as a number; −1 where they are absurdly large."""
    value = np.int64(0)
    for k in range(7, -1, -1):
        value = np.int64(value << 8) | np.int64(data[p + k])
    return int(value) if value >= 0 else -1


@compiled
def end_of_run(data: Bytes, p: int) -> int:
    """End of the run of message, schema and channel records that begins at ``p``."""
    while p + PREFIX <= len(data) and data[p] in (SCHEMA, CHANNEL, MESSAGE):
        length = length_at(data, p + 1)
        if length < 0 or length > len(data) - p - PREFIX:
            break
        p += PREFIX + length
    return p


def scan_records(data: Bytes) -> tuple[Integers, Integers, Integers, Integers, Integers]:
    """Messages of a run of records, and where schemas and channels are; a garbled record is stepped over.

    Returns
    -------
    channel, start, end, time : (n,) int64
        Of the messages.
    others : (m,) int64
    """
    size = len(data) // (PREFIX + MESSAGE_HEAD) + 16
    messages, others = np.empty((4, size), np.int64), np.empty(size, np.int64)
    n, m = _scan_records(data, messages, others)
    channel, start, end, times = (column[:n].copy() for column in messages)
    return channel, start, end, times, others[:m].copy()


@compiled
def _scan_records(data: Bytes, messages: Integers, others: Integers) -> tuple[int, int]:
    size = len(others)
    n = m = p = before = 0
    while p + PREFIX <= len(data) and n < size:
        length = length_at(data, p + 1)
        if length < 0 or length > len(data) - p - PREFIX or not 1 <= data[p] <= LAST_OPCODE:
            p = next_message(data, max(before, 0) + 1, messages[3, max(0, n - 3)] if n else 0)
            before = p
            continue
        if data[p] == MESSAGE and length >= MESSAGE_HEAD:
            body = p + PREFIX
            messages[0, n] = data[body] + 256 * np.int64(data[body + 1])
            messages[3, n] = length_at(data, body + 6)
            messages[1, n], messages[2, n] = body + MESSAGE_HEAD, body + length
            n += 1
        elif (data[p] == SCHEMA or data[p] == CHANNEL) and m < size:
            others[m] = p
            m += 1
        before = p
        p += PREFIX + length
    return n, m


@compiled
def next_message(data: Bytes, p: int, last: int) -> int:
    """Find the next message: a length that there is room for (its upper bytes are zero) and a time near ``last``.

    What comes after it is not looked at: it may be damaged, too.
    """
    while p + PREFIX + MESSAGE_HEAD <= len(data):
        if data[p] == MESSAGE:
            length = length_at(data, p + 1)
            whole = MESSAGE_HEAD <= length <= len(data) - p - PREFIX
            if whole and abs(length_at(data, p + PREFIX + 6) - last) < HOUR_NS:
                return p
        p += 1
    return len(data)
