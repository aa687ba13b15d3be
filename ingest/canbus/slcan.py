"""SLCAN, the text of serial CAN adapters: ``T09F1122480FF102700000000`` and a carriage return, one frame each.

``t`` and three hexadecimal digits of identifier, or ``T`` and eight; the number of data bytes; the bytes; and, where
the adapter stamps its frames, four digits of milliseconds that begin anew every minute. Answers of the adapter, remote
frames and blank lines are no damage; what else is no frame, is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ingest.canbus.frames import Frames
from ingest.compiled import compiled
from ingest.hexadecimal import hex_digit

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]

_RETURN, _NEWLINE, _BELL = 13, 10, 7
_FRAME, _LONG_FRAME, _REMOTE, _LONG_REMOTE = 116, 84, 114, 82


@dataclass(frozen=True)
class Lines:
    """Data frames in a stream of SLCAN.

    Attributes
    ----------
    end : (n,) int64
        One after the carriage return of each.
    can_id : (n,) uint32
    extended : (n,) bool
    dlc : (n,) uint8
    data : (n, 8) uint8
        0 beyond ``dlc``.
    damage : (m, 2) int64
        Byte ranges that are neither frames nor answers.
    remainder : int
        Where the line that is not complete yet begins.
    """

    end: Integers
    can_id: NDArray[np.uint32]
    extended: NDArray[np.bool_]
    dlc: NDArray[np.uint8]
    data: Bytes
    damage: Integers
    remainder: int

    def frames(self, time_ns: Integers) -> Frames:
        """The frames, with a time for each; (n,) ns."""
        bus = np.zeros(len(self.end), np.int16)
        return Frames(time_ns, self.can_id, self.extended, bus, self.dlc, self.data, ("can",))


def scan(data: bytes | memoryview | Bytes) -> Lines:
    """Find every data frame.

    Parameters
    ----------
    data : bytes-like
        The stream; it may begin and end anywhere.
    """
    text = data if isinstance(data, np.ndarray) else np.frombuffer(data, np.uint8)
    most, lines = _count(text)
    end, can_id = np.empty(most, np.int64), np.empty(most, np.uint32)
    extended, dlc, block = (
        np.empty(most, np.bool_),
        np.empty(most, np.uint8),
        np.zeros((most + 1, 8), np.uint8),
    )
    damage = np.empty((lines, 2), np.int64)
    n, holes, remainder = _scan(text, end, can_id, extended, dlc, block, damage)
    return Lines(end[:n], can_id[:n], extended[:n], dlc[:n], block[:n], damage[:holes].copy(), int(remainder))


@compiled
def _count(text: Bytes) -> tuple[int, int]:
    """Number of carriage returns, and of all marks that end a line."""
    frames = lines = 0
    for c in text:
        frames += c == _RETURN
        lines += c in (_RETURN, _NEWLINE, _BELL)
    return frames, lines


@compiled
def _frame(text: Bytes, p: int, stop: int, row: Bytes) -> tuple[int, int]:
    """Identifier and number of bytes of the frame that is all of ``text[p:stop]``; −1 where it is none."""
    digits = 8 if text[p] == _LONG_FRAME else 3
    if stop - p < digits + 2:
        return 0, -1
    identifier = 0
    for q in range(p + 1, p + 1 + digits):
        value = hex_digit(text[q])
        if value < 0:
            return 0, -1
        identifier = identifier * 16 + value
    size = hex_digit(text[p + 1 + digits])
    body = p + 2 + digits
    left = stop - body - 2 * size
    if (
        size < 0
        or size > 8
        or identifier > (0x1FFFFFFF if digits == 8 else 0x7FF)
        or (left != 0 and left != 4)
    ):
        return 0, -1
    for q in range(body, stop):
        if hex_digit(text[q]) < 0:
            return 0, -1
    for k in range(8):
        row[k] = hex_digit(text[body + 2 * k]) * 16 + hex_digit(text[body + 2 * k + 1]) if k < size else 0
    return identifier, size


@compiled
def _answer(text: Bytes, p: int, stop: int) -> bool:
    """Whether ``text[p:stop]``, a line without its end, is an answer, a remote frame or nothing."""
    if stop - p <= 1:
        return stop == p or text[p] == 122 or text[p] == 90
    if text[p] == _REMOTE or text[p] == _LONG_REMOTE:
        return True
    return stop - p <= 6 and (text[p] == 86 or text[p] == 118 or text[p] == 70 or text[p] == 78)


@compiled
def _start(text: Bytes, p: int, stop: int, row: Bytes) -> int:
    """Where in the line ``text[p:stop]`` a frame begins that goes on to its end; ``stop`` where none does."""
    for q in range(p, stop):
        if (text[q] == _FRAME or text[q] == _LONG_FRAME) and _frame(text, q, stop, row)[1] >= 0:
            return q
    return stop


@compiled
def _scan(
    text: Bytes,
    end: Integers,
    can_id: NDArray[np.uint32],
    extended: NDArray[np.bool_],
    dlc: NDArray[np.uint8],
    block: Bytes,
    damage: Integers,
) -> tuple[int, int, int]:
    """Fill the columns; number of frames, number of damaged stretches, and where the last line begins."""
    n, holes, p = 0, 0, 0
    for stop in range(len(text)):
        c = text[stop]
        if c not in (_RETURN, _NEWLINE, _BELL):
            continue
        first = _start(text, p, stop, block[n]) if c == _RETURN else stop
        if first > p and not _answer(text, p, first):
            damage[holes, 0], damage[holes, 1] = p, first
            holes += 1
        if first < stop:
            identifier, size = _frame(text, first, stop, block[n])
            can_id[n], extended[n], dlc[n] = identifier, text[first] == _LONG_FRAME, size
            end[n] = stop + 1
            n += 1
        p = stop + 1
    return n, holes, p
