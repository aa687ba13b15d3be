"""Find the messages of a PX4 ULog in its bytes.

A message is its size (two bytes), its type, and its body; there is no checksum. A data message must have the
size of its subscription's format; what tells the others is that a good message follows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ingest.compiled import compiled

BLOCK = 1 << 19
HEADER, FILE_HEADER = 3, 16
RECORD = np.dtype([("start", "i8"), ("size", "u2"), ("kind", "u1"), ("identity", "u2")])
#: Largest body that is believed, by type of message; 0 for what is no type.
LIMITS = {
    "B": 256, "F": 4_096, "I": 4_096, "M": 4_096, "P": 512, "Q": 512, "A": 512, "R": 2, "L": 2_048,
    "C": 2_048,
    "S": 8, "O": 2, "D": 65_535,
}  # fmt: skip
DATA, FORMAT, ADD, DROPOUT, SYNC, REMOVE = (ord(letter) for letter in "DFAOSR")
#: How far into a doubtful message a better start is looked for.
LOOK_INSIDE = 4_096


@dataclass(frozen=True)
class Sizes:
    """Sizes of data bodies by subscription: (65536,) int32 each, −1 where there is no such subscription."""

    least: NDArray[np.int32]
    most: NDArray[np.int32]


def no_sizes() -> Sizes:
    """No subscription yet."""
    return Sizes(*(np.full(1 << 16, -1, dtype=np.int32) for _ in range(2)))


def limits_table() -> NDArray[np.int64]:
    """``LIMITS`` by character code; (256,)."""
    table = np.full(256, -1, dtype=np.int64)
    for character, limit in LIMITS.items():
        table[ord(character)] = limit
    return table


@compiled
def total_at(
    b: NDArray[np.uint8],
    p: int,
    limits: NDArray[np.int64],
    least: NDArray[np.int32],
    most: NDArray[np.int32],
) -> int:  # pragma: no cover - compiled
    """Length, with header, of the message at ``p``; 0 where there can be none; −1 where it is cut off."""
    n = len(b)
    if p + HEADER > n:
        return -1
    size, kind = np.int64(b[p]) | np.int64(b[p + 1]) << 8, b[p + 2]
    if size > limits[kind] or size == 0:
        return 0
    if kind == DATA:
        if p + 5 > n:
            return -1
        identity = np.int64(b[p + 3]) | np.int64(b[p + 4]) << 8
        if least[identity] < 0 or not least[identity] <= size - 2 <= most[identity]:
            return 0
    elif kind in (SYNC, DROPOUT, REMOVE) and size != limits[kind]:
        return 0
    return int(HEADER + size) if p + HEADER + size <= n else -1


@compiled
def chain_inside(
    b: NDArray[np.uint8],
    p: int,
    stop: int,
    limits: NDArray[np.int64],
    least: NDArray[np.int32],
    most: NDArray[np.int32],
) -> int:  # pragma: no cover - compiled
    """Where, in ``p``…``stop``, a data message starts that a message follows; −1 if nowhere."""
    for q in range(p, stop):
        total = total_at(b, q, limits, least, most)
        if total > 0 and b[q + 2] == DATA and total_at(b, q + total, limits, least, most) != 0:
            return q
    return -1


@compiled
def scan_block(
    b: NDArray[np.uint8],
    p: int,
    sure: bool,
    limits: NDArray[np.int64],
    least: NDArray[np.int32],
    most: NDArray[np.int32],
    out: NDArray[np.void],
) -> tuple[int, int, bool]:  # pragma: no cover - compiled
    """Fill ``out`` from ``p`` on, up to and with the next definition.

    Returns how many, where the scan stopped, and whether it stopped right after a message.
    """
    count, n = 0, len(b)
    while p < n and count < len(out):
        total = total_at(b, p, limits, least, most)
        if total > 0:
            followed = p + total == n or total_at(b, p + total, limits, least, most) != 0
            if not followed or b[p + 2] != DATA:  # only the size of data is known beforehand
                stop = min(p + total, p + LOOK_INSIDE)
                inside = chain_inside(b, p + 1, stop, limits, least, most)
                if inside >= 0 or not (sure or followed or b[p + 2] == DATA):
                    total = 0
        if total <= 0:
            p += 1
            sure = False
            continue
        record = out[count]
        record.start, record.size, record.kind = p, total - HEADER, b[p + 2]
        record.identity = np.int64(b[p + 3]) | np.int64(b[p + 4]) << 8 if total >= 5 else 0
        count += 1
        kind = b[p + 2]
        p += total
        sure = True
        if kind in (FORMAT, ADD):
            break
    return count, p, sure
