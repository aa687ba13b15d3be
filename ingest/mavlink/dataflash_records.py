"""Find the records of an ArduPilot DataFlash log in its bytes.

A record is ``A3 95``, its type, and a body whose length its FMT record gave; there is no checksum. What tells a good
record is that another follows. Where none does, either junk follows or the record itself is damaged: if a chain of
records starts inside it, it is damaged; otherwise it is kept, as weak, and its time must fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ingest.compiled import compiled

BLOCK = 1 << 19
RECORD = np.dtype([("start", "i8"), ("kind", "u1"), ("length", "u1"), ("weak", "?")])
HEADER, HEAD1, HEAD2 = 3, 0xA3, 0x95
FMT, FMT_LENGTH = 128, 89
#: Bytes of each format character; 0 where it is not one.
SIZES = {
    "a": 64, "b": 1, "B": 1, "g": 2, "h": 2, "H": 2, "i": 4, "I": 4, "f": 4, "n": 4, "N": 16, "Z": 64,
    "c": 2, "C": 2,
    "e": 4, "E": 4, "L": 4, "d": 8, "M": 1, "q": 8, "Q": 8,
}  # fmt: skip


@dataclass(frozen=True)
class Records:
    """Records in the order of the bytes.

    Attributes
    ----------
    start : (n,) int64
        Offset of the header.
    kind : (n,) uint8
        Type.
    length : (n,) uint8
        With header.
    weak : (n,) bool
        Whether no record follows directly.
    """

    start: NDArray[np.int64]
    kind: NDArray[np.uint8]
    length: NDArray[np.uint8]
    weak: NDArray[np.bool_]

    def keep(self, mask: NDArray[np.bool_]) -> Records:
        """Give the records that a mask selects."""
        return Records(self.start[mask], self.kind[mask], self.length[mask], self.weak[mask])


def sizes_table() -> NDArray[np.uint8]:
    """Sizes by character code; (256,) uint8."""
    table = np.zeros(256, dtype=np.uint8)
    for character, size in SIZES.items():
        table[ord(character)] = size
    return table


@compiled
def length_at(b: NDArray[np.uint8], p: int, lengths: NDArray[np.int64]) -> int:  # pragma: no cover - compiled
    """Length of the record at ``p``; 0 where there is none, or where it would not be complete."""
    if p + HEADER > len(b) or b[p] != HEAD1 or b[p + 1] != HEAD2:
        return 0
    length = lengths[b[p + 2]]
    return length if p + length <= len(b) else 0


@compiled
def goes_on(b: NDArray[np.uint8], p: int, lengths: NDArray[np.int64]) -> bool:  # pragma: no cover - compiled
    """Whether at ``p`` a record of a known type starts (complete or not), or the bytes end."""
    n = len(b)
    if p + HEADER > n:
        return p == n or (b[p] == HEAD1 and (p + 1 == n or b[p + 1] == HEAD2))
    return bool(b[p] == HEAD1 and b[p + 1] == HEAD2 and lengths[b[p + 2]] > 0)


@compiled
def chain_inside(
    b: NDArray[np.uint8], p: int, stop: int, lengths: NDArray[np.int64]
) -> int:  # pragma: no cover - compiled
    """Where, in ``p``…``stop``, a record starts that another follows; −1 if nowhere."""
    for q in range(p, stop):
        length = length_at(b, q, lengths)
        if length > 0 and q + length < len(b) and goes_on(b, q + length, lengths):
            return q
    return -1


@compiled
def learn(
    b: NDArray[np.uint8], p: int, lengths: NDArray[np.int64], sizes: NDArray[np.uint8]
) -> None:  # pragma: no cover - compiled
    """Take the length of a type from the FMT record at ``p``, if its format is sound."""
    total, k = HEADER, 0
    while k < 16 and b[p + 9 + k] != 0:
        size = int(np.int64(sizes[b[p + 9 + k]]))
        if size == 0:
            return
        total += size
        k += 1
    if k > 0 and total < 256:
        lengths[b[p + 3]] = total


@compiled
def scan_block(
    b: NDArray[np.uint8],
    p: int,
    lengths: NDArray[np.int64],
    sizes: NDArray[np.uint8],
    out: NDArray[np.void],
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Fill ``out`` with records from ``p`` on; how many, and where the scan stopped."""
    count, n = 0, len(b)
    while p < n and count < len(out):
        length = length_at(b, p, lengths)
        if length == 0:
            p += 1
            continue
        followed = goes_on(b, p + length, lengths)
        if not followed:
            inside = chain_inside(b, p + HEADER, p + length, lengths)
            if inside >= 0:
                p = inside
                continue
        record = out[count]
        record.start, record.kind, record.length, record.weak = p, b[p + 2], length, not followed
        count += 1
        if b[p + 2] == FMT:
            learn(b, p, lengths, sizes)
        p += length
    return count, p


def scan(data: memoryview | bytes) -> Records:
    """Find all records.

    Parameters
    ----------
    data : bytes-like
    """
    b = np.frombuffer(data, dtype=np.uint8)
    lengths = np.zeros(256, dtype=np.int64)
    lengths[FMT] = FMT_LENGTH
    sizes, p, blocks = sizes_table(), 0, []
    while p < len(b):
        block = np.empty(BLOCK, dtype=RECORD)
        count, p = scan_block(b, p, lengths, sizes, block)
        blocks.append(block[:count].copy() if count < BLOCK else block)
    found = blocks[0] if len(blocks) == 1 else np.concatenate([np.empty(0, dtype=RECORD), *blocks])
    return Records(*(np.ascontiguousarray(found[name]) for name in ("start", "kind", "length", "weak")))


def gather_times(
    b: NDArray[np.uint8], start: NDArray[np.int64], kind: NDArray[np.uint8], width: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Nanoseconds from the first field of each record; −1 where it has no time.

    ``width`` by type: 8 for TimeUS (microseconds), 4 for TimeMS (milliseconds), 0 for none.
    """
    out = np.full(len(start), -1, dtype=np.int64)
    fill_times(b, start, kind, width, out)
    return out


@compiled
def fill_times(
    b: NDArray[np.uint8],
    start: NDArray[np.int64],
    kind: NDArray[np.uint8],
    width: NDArray[np.int64],
    out: NDArray[np.int64],
) -> None:  # pragma: no cover - compiled
    """Fill in ``out`` where there is a time."""
    for i in range(len(start)):
        w = width[kind[i]]
        if w == 0:
            continue
        value = np.int64(0)
        for k in range(w):
            value |= np.int64(b[start[i] + HEADER + k]) << np.int64(8 * k)
        factor = 1_000 if w == 8 else 1_000_000
        if 0 <= value < 9_000_000_000_000_000 // (factor // 1_000):
            out[i] = value * factor
