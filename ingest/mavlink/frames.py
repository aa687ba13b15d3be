"""Find MAVLink frames in bytes: version 1 and 2, signed or not, checksums verified, next to any damage.

One pass, compiled. A frame counts if its checksum is right; on failure the scan goes on one byte further, so that
junk, lost bytes and broken frames cost nothing but themselves. A frame of an unknown type (whose checksum cannot be
verified) counts only where it follows directly on a good frame and is itself followed by one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ingest.compiled import compiled
from ingest.mavlink.dialect import Dialect

#: Frames per call of the compiled scan; bounds what is allocated ahead.
BLOCK = 1 << 18
#: How many unknown frames in a row are believed.
UNKNOWN_RUN = 16
V1, V2, SIGNED = 0xFE, 0xFD, 0x01

FRAME = np.dtype(
    [
        ("start", "i8"),
        ("end", "i8"),
        ("number", "i4"),
        ("payload", "u1"),
        ("length", "u1"),
        ("sequence", "u1"),
        ("system", "u1"),
        ("component", "u1"),
        ("direct", "?"),
    ]
)


@dataclass(frozen=True)
class Frames:
    """Frames in the order of the bytes.

    Attributes
    ----------
    table : (n,) FRAME
        ``start`` and ``end`` of the frame, ``number`` (message id), ``payload`` (its offset from ``start``),
        ``length`` (of the payload), ``sequence``, ``system``, ``component``; ``direct``: whether it follows
        on the frame before, with nothing but the time stamp between.
    kind : (n,) int16
        Position in ``Dialect.types``; −1 where the type is not known.
    """

    table: NDArray[np.void]
    kind: NDArray[np.int16]


def crc_table() -> NDArray[np.uint16]:
    """Tables of CRC-16/MCRF4XX (reflected 0x1021) for four bytes at a time, one after the other; (1024,)."""
    one = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        one = np.where(one & 1, one >> 1 ^ 0x8408, one >> 1).astype(np.uint16)
    tables = [one]
    for _ in range(3):
        tables.append(tables[-1] >> 8 ^ one[tables[-1] & 0xFF])
    return np.concatenate(tables)


@compiled
def extent(b: NDArray[np.uint8], p: int) -> tuple[int, int, int, int]:  # pragma: no cover - compiled
    """Payload offset and length, total length, message id of a frame at ``p``; total 0 if none can be."""
    n = len(b)
    if p + 8 > n:
        return 0, 0, 0, 0
    if b[p] == V1:
        length = int(np.int64(b[p + 1]))
        total = 8 + length
        return 6, length, (total if p + total <= n else 0), int(np.int64(b[p + 5]))
    if b[p] != V2 or p + 12 > n:
        return 0, 0, 0, 0
    length = int(np.int64(b[p + 1]))
    total = 12 + length + (13 if b[p + 2] & SIGNED else 0)
    number = int(np.int64(b[p + 7])) | int(np.int64(b[p + 8])) << 8 | int(np.int64(b[p + 9])) << 16
    return 10, length, (total if p + total <= n else 0), number


@compiled
def checked(
    b: NDArray[np.uint8], p: int, last: int, extra: int, table: NDArray[np.uint16]
) -> bool:  # pragma: no cover - compiled
    """Whether the checksum at ``last`` is that of the bytes from ``p + 1`` and the seed of the type."""
    low, four = np.uint32(0xFF), p + 1 + (last - p - 1) // 4 * 4
    crc = np.uint32(0xFFFF)
    for i in range(p + 1, four, 4):
        crc ^= np.uint32(b[i]) | np.uint32(b[i + 1]) << np.uint32(8)
        near = np.uint32(table[768 + (crc & low)]) ^ np.uint32(table[512 + (crc >> np.uint32(8))])
        crc = near ^ np.uint32(table[256 + b[i + 2]]) ^ np.uint32(table[b[i + 3]])
    for i in range(four, last):
        crc = (crc >> np.uint32(8)) ^ np.uint32(table[(crc ^ np.uint32(b[i])) & low])
    crc = (crc >> np.uint32(8)) ^ np.uint32(table[(crc ^ np.uint32(extra)) & low])
    return bool(crc == (np.uint32(b[last]) | np.uint32(b[last + 1]) << np.uint32(8)))


@compiled
def judge(
    b: NDArray[np.uint8],
    p: int,
    index: NDArray[np.int16],
    extra: NDArray[np.uint8],
    table: NDArray[np.uint16],
) -> int:  # pragma: no cover - compiled
    """2: a good frame at ``p``; 1: a frame of unknown type might be; 0: none."""
    payload, length, total, number = extent(b, p)
    if total == 0:
        return 0
    kind = index[number] if number < len(index) else -1
    if kind < 0:
        return 1
    return 2 if checked(b, p, p + payload + length, extra[kind], table) else 0


@compiled
def believed(
    b: NDArray[np.uint8],
    p: int,
    lead: int,
    index: NDArray[np.int16],
    extra: NDArray[np.uint8],
    table: NDArray[np.uint16],
) -> bool:  # pragma: no cover - compiled
    """Whether unknown frames from ``p`` on lead to a good one, or to the very end of the bytes."""
    for _ in range(UNKNOWN_RUN):
        p += extent(b, p)[2]
        if p == len(b):
            return True
        p += lead
        verdict = judge(b, p, index, extra, table)
        if verdict != 1:
            return verdict == 2
    return False


@compiled
def scan_block(
    b: NDArray[np.uint8],
    end: int,
    lead: int,
    index: NDArray[np.int16],
    extra: NDArray[np.uint8],
    table: NDArray[np.uint16],
    out: NDArray[np.void],
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Fill ``out`` with frames after ``end`` (of the frame before); how many, and the end of the last one."""
    n, count = len(b), 0
    p, direct = end + lead, True
    while p < n and count < len(out):
        verdict = 0
        if b[p] == V2 or b[p] == V1:
            verdict = judge(b, p, index, extra, table)
            if verdict == 1 and not (direct and believed(b, p, lead, index, extra, table)):
                verdict = 0
        if verdict == 0:
            p = end if direct and lead else p + 1
            direct = False
            continue
        payload, length, total, number = extent(b, p)
        f = out[count]
        f.start, f.end, f.number, f.payload, f.length = p, p + total, number, payload, length
        at = p + 2 if payload == 6 else p + 4
        f.sequence, f.system, f.component, f.direct = b[at], b[at + 1], b[at + 2], direct
        count += 1
        end = p + total
        p, direct = end + lead, True
    return count, end


def scan(data: memoryview | bytes, dialect: Dialect, lead: int = 0) -> Frames:
    """Find all frames.

    Parameters
    ----------
    data : bytes-like
    dialect : Dialect
    lead : int
        Bytes of a time stamp before each frame: 8 in a tlog, 0 in a stream.
    """
    b = np.frombuffer(data, dtype=np.uint8)
    table, end, blocks = crc_table(), 0, []
    while True:
        out = np.empty(BLOCK, dtype=FRAME)
        count, end = scan_block(b, end, lead, dialect.index, dialect.crc_extra, table, out)
        blocks.append(out[:count].copy() if count < BLOCK else out)
        if count < BLOCK:
            break
    frames = np.concatenate(blocks)
    number = frames["number"]
    known = number < len(dialect.index)
    kind = np.where(known, dialect.index[np.where(known, number, 0)], -1).astype(np.int16)
    return Frames(frames, kind)


@compiled
def gather_payloads(
    b: NDArray[np.uint8], start: NDArray[np.int64], length: NDArray[np.uint8], out: NDArray[np.uint8]
) -> None:  # pragma: no cover - compiled
    """Copy payloads into the rows of ``out`` (n, size), which is zero: trimmed payloads end in zeros."""
    size = out.shape[1]
    for i in range(len(start)):
        for k in range(min(size, int(np.int64(length[i])))):
            out[i, k] = b[start[i] + k]


def gather_stamps(b: NDArray[np.uint8], start: NDArray[np.int64]) -> NDArray[np.int64]:
    """Big-endian microseconds in the eight bytes before each start, in nanoseconds; −1 for none."""
    out = np.full(len(start), -1, dtype=np.int64)
    fill_stamps(b, start, out)
    return out


@compiled
def fill_stamps(
    b: NDArray[np.uint8], start: NDArray[np.int64], out: NDArray[np.int64]
) -> None:  # pragma: no cover - compiled
    """Fill in ``out`` where there is a stamp."""
    for i in range(len(start)):
        if start[i] >= 8:
            value = np.int64(0)
            for k in range(start[i] - 8, start[i]):
                value = value << np.int64(8) | np.int64(b[k])
            if 0 <= value < 9_000_000_000_000_000:
                out[i] = value * 1000
