"""Lines of a text log, found and grouped by their first word in compiled passes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ingest.compiled import compiled

LINE = np.dtype(
    [("start", "i8"), ("end", "i8"), ("word", "i8"), ("commas", "i4"), ("odd", "i4"), ("hash", "u8")]
)
NEWLINE, RETURN, COMMA = 10, 13, 44


@compiled
def scan_lines(
    b: NDArray[np.uint8], p: int, out: NDArray[np.void]
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Fill ``out`` with lines from ``p`` on: their extent, first word, commas, odd bytes."""
    count, n = 0, len(b)
    while p < n and count < len(out):
        start, commas, odd, word, key = p, 0, 0, -1, np.uint64(14695981039346656037)
        while p < n and b[p] != NEWLINE:
            if b[p] == COMMA:
                commas += 1
                word = p if word < 0 else word
            elif word < 0:
                key = (key ^ np.uint64(b[p])) * np.uint64(1099511628211)
            odd += b[p] < 32 or b[p] > 126
            p += 1
        end = p - 1 if p > start and b[p - 1] == RETURN else p
        line = out[count]
        line.start, line.end, line.commas, line.hash = start, end, commas, key
        line.odd = odd - (p - end)
        line.word = word if word >= 0 else end
        count += 1
        p += 1
    return count, p


def find_lines(data: memoryview | bytes, block: int = 1 << 18) -> NDArray[np.void]:
    """All lines; (n,) LINE."""
    b, p, blocks = np.frombuffer(data, dtype=np.uint8), 0, [np.empty(0, dtype=LINE)]
    while p < len(b):
        out = np.empty(block, dtype=LINE)
        count, p = scan_lines(b, p, out)
        blocks.append(out[:count].copy() if count < block else out)
    return np.concatenate(blocks)


@compiled
def copy_rests(
    b: NDArray[np.uint8], word: NDArray[np.int64], end: NDArray[np.int64], out: NDArray[np.uint8]
) -> None:  # pragma: no cover - compiled
    """Copy what follows the first word and its comma, a line each."""
    at = 0
    for i in range(len(word)):
        for k in range(word[i] + 1, end[i]):
            out[at] = b[k]
            at += 1
        out[at] = NEWLINE
        at += 1


def rests(data: memoryview | bytes, lines: NDArray[np.void]) -> bytes:
    """Give the lines without their first word, one under another."""
    word, end = np.ascontiguousarray(lines["word"]), np.ascontiguousarray(lines["end"])
    out = np.empty(int((np.maximum(end - word - 1, 0) + 1).sum()), dtype=np.uint8)
    copy_rests(np.frombuffer(data, dtype=np.uint8), word, end, out)
    return out.tobytes()
