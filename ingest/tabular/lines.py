"""Lines of delimited text: where each one is and how many fields it has, without parsing it."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

#: Bytes looked at in one go, so that the masks stay small beside the file.
CHUNK = 1 << 20
#: Bytes that are parsed in one go.
PIECE = 1 << 22

#: A quoted field that goes on in the next lines (RFC 4180): from a delimiter to a delimiter.
BROKEN_FIELD = re.compile(
    rb'"(?<![^,;|\t\n]")[^"\n]*(?:""[^"\n]*){0,99}\n[^"]{0,999}(?:""[^"]{0,999}){0,99}"(?=[ \r]*(?:[,;|\t\n]|\Z))'
)

NEWLINE, RETURN, BLANK, TAB, QUOTE = 10, 13, 32, 9, 34


@dataclass(frozen=True)
class Lines:
    """Every line of a text.

    Attributes
    ----------
    start, end : (n,) int64
        Byte range of each line, the line's end mark included.
    fields : (n,) int64
        Number of fields; 0 for a blank line.
    """

    start: NDArray[np.int64]
    end: NDArray[np.int64]
    fields: NDArray[np.int64]


def with_whole_fields(text: memoryview) -> memoryview:
    """A text in which no quoted field goes over a line's end: blanks instead, so that every byte keeps its place."""
    found = [m.span() for m in BROKEN_FIELD.finditer(text)]
    if not found:
        return text
    whole = bytearray(text)
    for a, b in found:
        whole[a:b] = whole[a:b].replace(b"\n", b" ").replace(b"\r", b" ")
    return memoryview(bytes(whole))


def chunks_of_lines(data: NDArray[np.uint8], start: int, size: int = CHUNK) -> Iterator[tuple[int, int]]:
    """Byte ranges of about ``size`` bytes that end with a line."""
    while start < len(data):
        stop = min(start + size, len(data))
        while stop < len(data):
            breaks = np.flatnonzero(data[start:stop] == NEWLINE)
            if len(breaks):
                stop = start + int(breaks[-1]) + 1
                break
            stop = min(stop + size, len(data))
        yield start, stop
        start = stop


def count_fields(data: NDArray[np.uint8], delimiter: str, start: int = 0) -> Lines:
    """Find the lines from byte ``start`` on, and count the fields of each.

    Parameters
    ----------
    data : (n,) uint8
        The text.
    delimiter : str
        One character; a blank stands for any run of blanks and tabs.
    """
    parts = [_count_chunk(data[a:b], delimiter, a) for a, b in chunks_of_lines(data, start)]
    if not parts:
        none = np.zeros(0, np.int64)
        return Lines(none, none, none)
    return Lines(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _count_chunk(
    chunk: NDArray[np.uint8], delimiter: str, origin: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    ends = np.flatnonzero(chunk == NEWLINE).astype(np.int64) + 1
    if not len(ends) or ends[-1] != len(chunk):
        ends = np.append(ends, len(chunk))
    starts = np.concatenate(([0], ends[:-1]))
    printed = chunk > BLANK
    ink = _sum_per_line(printed, starts, ends)
    if delimiter == " ":
        before = np.concatenate(([False], printed[:-1]))
        return starts + origin, ends + origin, _sum_per_line(printed & ~before, starts, ends)
    marks = chunk == ord(delimiter)
    quotes = chunk == QUOTE
    open_ended = np.zeros(len(starts), dtype=bool)
    if quotes.any():
        marks &= ~_inside_quotes(quotes, starts, ends)
        open_ended = _sum_per_line(quotes, starts, ends) % 2 == 1
    separators = _sum_per_line(marks, starts, ends)
    fields = np.where((ink > 0) | (separators > 0), separators + 1, 0)
    # a quote that nothing closes would take the lines below into its field
    return starts + origin, ends + origin, np.where(open_ended, 1, fields)


def _sum_per_line(
    mask: NDArray[np.bool_], starts: NDArray[np.int64], ends: NDArray[np.int64]
) -> NDArray[np.int64]:
    total = np.concatenate(([0], np.cumsum(mask, dtype=np.int64)))
    sums: NDArray[np.int64] = total[ends] - total[starts]
    return sums


def _inside_quotes(
    quotes: NDArray[np.bool_], starts: NDArray[np.int64], ends: NDArray[np.int64]
) -> NDArray[np.bool_]:
    total = np.cumsum(quotes, dtype=np.int64)
    before = np.where(starts > 0, total[starts - 1], 0)
    inside: NDArray[np.bool_] = ((total - np.repeat(before, ends - starts)) & 1).astype(bool)
    return inside


class Spans(io.RawIOBase):
    """A read-only stream over chosen byte ranges of a buffer, without a copy of it."""

    def __init__(self, data: memoryview, spans: Sequence[tuple[int, int]]) -> None:
        self._parts = [data[a:b] for a, b in spans if b > a]
        self._part, self._at = 0, 0

    def readable(self) -> bool:
        """Return always true."""
        return True

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        """Fill ``buffer`` with the next bytes; 0 at the end."""
        while self._part < len(self._parts):
            part = self._parts[self._part]
            size = min(len(buffer), len(part) - self._at)
            if size:
                buffer[:size] = part[self._at : self._at + size]
                self._at += size
                return size
            self._part, self._at = self._part + 1, 0
        return 0


def runs(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Half-open index ranges in which ``chosen`` is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], chosen.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def spans_of(lines: Lines, chosen: NDArray[np.bool_], size: int = PIECE) -> Iterator[list[tuple[int, int]]]:
    """Byte ranges of the chosen lines, in pieces of about ``size`` bytes."""
    cuts = np.flatnonzero(np.diff(lines.start // size)) + 1
    for a, b in pairwise([0, *cuts.tolist(), len(lines.start)]):
        yield [(int(lines.start[a + i]), int(lines.end[a + j - 1])) for i, j in runs(chosen[a:b])]
