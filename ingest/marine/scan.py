"""Find the records in a stream of serial bytes: NMEA 0183, UBX, RTCM3, interleaved, with junk between them.

A record is taken only if its checksum is right; where it is not, the search goes on at the next byte, so that a
record that was cut short never hides the one after it. Lengths are checked against what is there before they are
used. Compiled: hundreds of megabytes a second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ingest.compiled import compiled
from ingest.hexadecimal import hex_digit

Bytes = NDArray[np.uint8]

#: Kinds of record.
NMEA, NMEA_UNCHECKED, UBX, RTCM3 = 0, 1, 2, 3
#: Longest sentence that is looked for (the standard allows 82 characters, makers' own sentences are longer).
LONGEST_SENTENCE = 1024
#: Records per call of the compiled search.
BLOCK = 1 << 18
#: RTCM3 frames and UBX headers are this long around their payload.
RTCM_OVERHEAD, UBX_OVERHEAD = 6, 8

_DOLLAR, _BANG, _STAR, _COMMA, _HASH = 36, 33, 42, 44, 35
_CR, _LF, _TAB, _BLANK = 13, 10, 9, 32


@dataclass(frozen=True)
class Records:
    """Records in the order of the stream.

    Attributes
    ----------
    kind : (n,) uint8
        ``NMEA``, ``NMEA_UNCHECKED``, ``UBX`` or ``RTCM3``.
    start, end : (n,) int64
        Byte range, from the first byte of the record to its last (an NMEA sentence without its line end).
    prefix : (n,) int64
        Where the text before the record on its line begins (``start`` where there is none).
    damage : (m, 2) int64
        Byte ranges that belong to no record, line end, remark or text before a record.
    """

    kind: NDArray[np.uint8]
    start: NDArray[np.int64]
    end: NDArray[np.int64]
    prefix: NDArray[np.int64]
    damage: NDArray[np.int64]

    def without(self, some: NDArray[np.bool_]) -> Records:
        """All but some (n,) of the records."""
        kept = ~some
        return Records(self.kind[kept], self.start[kept], self.end[kept], self.prefix[kept], self.damage)


def scan(data: Bytes) -> Records:
    """Find every record with a right checksum, and what lies between them.

    Parameters
    ----------
    data : (n,) uint8
        The stream.
    """
    kind, start, end = _found(data)
    unchecked = kind == NMEA_UNCHECKED
    if unchecked.sum() * 2 <= (kind <= NMEA_UNCHECKED).sum():
        kind, start, end = kind[~unchecked], start[~unchecked], end[~unchecked]
    prefix, damage = np.empty(len(start), np.int64), np.empty((len(start) + 1, 2), np.int64)
    holes = _between(data, start, end, prefix, damage)
    return Records(kind, start, end, prefix, damage[:holes].copy())


def _found(data: Bytes) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]:
    """Kind, start and end of every record, block by block."""
    size = min(BLOCK, len(data) // 8 + 16)
    table, blocks, p = _crc24_table(), [], 0
    while True:
        block = np.empty(size, np.uint8), np.empty(size, np.int64), np.empty(size, np.int64)
        count, p = _records(data, p, table, *block)
        blocks.append(block if count == size else tuple(column[:count].copy() for column in block))
        if count < size:
            kind, start, end = (np.concatenate(columns) for columns in zip(*blocks, strict=True))
            return kind, start, end


def _crc24_table() -> NDArray[np.uint32]:
    """CRC-24Q, as RTCM3 carries it, of each byte."""
    crc = np.arange(256, dtype=np.uint32) << np.uint32(16)
    for _ in range(8):
        over = crc & np.uint32(0x800000) != 0
        crc = np.where(
            over, (crc << np.uint32(1) ^ np.uint32(0x1864CFB)) & np.uint32(0xFFFFFF), crc << np.uint32(1)
        )
    return crc.astype(np.uint32)


@compiled
def _crc16(data: Bytes, a: int, b: int) -> int:
    """CRC-16/XMODEM, as VectorNav's sentences may carry it."""
    crc = 0
    for i in range(a, b):
        crc ^= data[i] << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021) & 0xFFFF if crc & 0x8000 else (crc << 1) & 0xFFFF
    return crc


@compiled
def _sentence_end(data: Bytes, p: int) -> int:
    """End of the sentence that starts at ``p``; negative where it has no checksum; 0 where there is none."""
    n = min(len(data), p + LONGEST_SENTENCE)
    xor = 0
    for q in range(p + 1, n):
        c = data[q]
        if c == _STAR:
            break
        if c in (_CR, _LF):
            return -q if q - p > 6 and _plausible(data, p) else 0
        if c == _DOLLAR or c < _BLANK or c == 127:
            return 0
        xor ^= c
    else:
        return 0
    if q + 2 >= len(data) or q - p < 4:
        return 0
    high, low = hex_digit(data[q + 1]), hex_digit(data[q + 2])
    if high < 0 or low < 0:
        return 0
    if high * 16 + low == xor:
        return q + 3
    if q + 4 < len(data):
        third, fourth = hex_digit(data[q + 3]), hex_digit(data[q + 4])
        given = ((high * 16 + low) * 16 + third) * 16 + fourth
        if third >= 0 and fourth >= 0 and _crc16(data, p + 1, q) == given:
            return q + 5
    return 0


@compiled
def _plausible(data: Bytes, p: int) -> bool:
    """Whether an address field of capital letters and digits and a comma follow."""
    for q in range(p + 1, p + 9):
        c = data[q]
        if c == _COMMA:
            return q - p >= 4
        if not (65 <= c <= 90 or 48 <= c <= 57):
            return False
    return False


@compiled
def _ubx_end(data: Bytes, p: int) -> int:
    """End of the UBX frame at ``p``, 0 where there is none."""
    if p + UBX_OVERHEAD > len(data) or data[p + 1] != 0x62:
        return 0
    end = p + UBX_OVERHEAD + data[p + 4] + 256 * data[p + 5]
    if end > len(data):
        return 0
    a, b = np.uint8(0), np.uint8(0)
    for q in range(p + 2, end - 2):
        a = np.uint8(a + data[q])
        b = np.uint8(b + a)
    return end if a == data[end - 2] and b == data[end - 1] else 0


@compiled
def _rtcm_end(data: Bytes, p: int, table: NDArray[np.uint32]) -> int:
    """End of the RTCM3 frame at ``p``, 0 where there is none."""
    if p + RTCM_OVERHEAD > len(data) or data[p + 1] & 0xFC:
        return 0
    end = p + RTCM_OVERHEAD + ((data[p + 1] & 3) << 8) + data[p + 2]
    if end > len(data):
        return 0
    crc = np.uint32(0)
    for q in range(p, end - 3):
        crc = (
            np.uint32((crc << np.uint32(8)) & np.uint32(0xFFFFFF))
            ^ table[(crc >> np.uint32(16)) ^ np.uint32(data[q])]
        )
    given = (np.uint32(data[end - 3]) << 16) | (np.uint32(data[end - 2]) << 8) | np.uint32(data[end - 1])
    return end if crc == given else 0


@compiled
def _records(
    data: Bytes,
    p: int,
    table: NDArray[np.uint32],
    kinds: NDArray[np.uint8],
    starts: NDArray[np.int64],
    ends: NDArray[np.int64],
) -> tuple[int, int]:
    """Fill in records from ``p`` on; how many, and where the search stopped."""
    count = 0
    while p < len(data) and count < len(kinds):
        c, end, kind = data[p], 0, NMEA
        if c in (_DOLLAR, _BANG):
            end = _sentence_end(data, p)
            if end < 0:
                end, kind = -end, NMEA_UNCHECKED
        elif c == 0xB5:
            end, kind = _ubx_end(data, p), UBX
        elif c == 0xD3:
            end, kind = _rtcm_end(data, p, table), RTCM3
        if end == 0:
            p += 1
            continue
        kinds[count], starts[count], ends[count] = kind, p, end
        count, p = count + 1, end
    return count, p


@compiled
def _between(
    data: Bytes,
    start: NDArray[np.int64],
    end: NDArray[np.int64],
    prefix: NDArray[np.int64],
    damage: NDArray[np.int64],
) -> int:
    """Fill in the text before each record on its line, and the ranges that are damage; how many those are."""
    n, count = len(start), 0
    for i in range(n + 1):
        a = end[i - 1] if i else 0
        b = start[i] if i < n else len(data)
        if i < n:
            prefix[i] = b
        if b - a <= 2 and (b == a or (data[a] <= _CR and data[b - 1] <= _CR)):
            continue
        first, last, text = _judge(data, a, b, i < n, i == 0)
        if i < n:
            prefix[i] = text
        if last > first:
            damage[count, 0], damage[count, 1] = first, last
            count += 1
    return count


@compiled
def _judge(data: Bytes, a: int, b: int, before_record: bool, at_start: bool) -> tuple[int, int, int]:
    """Damaged range of the gap ``a:b`` (empty if all is well), and where the text before a record begins."""
    first, last, prefix = b, a, b
    line, own_line = a, at_start
    if at_start and b >= 3 and data[0] == 0xEF and data[1] == 0xBB and data[2] == 0xBF:
        line = 3  # the mark of UTF-8 belongs to no record
    while line < b:
        stop = line
        clean, inked = True, False
        while stop < b and data[stop] != _LF:
            c = data[stop]
            if c > _BLANK:
                inked = True
            if c == _DOLLAR or c > 126 or (c < _BLANK and c != _CR and c != _TAB):
                clean = False
            stop += 1
        if inked or not clean:
            remark = clean and own_line and data[line] == _HASH and stop < b
            if stop == b and before_record and clean and own_line:
                prefix = line
            elif not remark:
                first, last = min(first, line), stop
        line, own_line = stop + 1, True
    return first, min(last, b), prefix
