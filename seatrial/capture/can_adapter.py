"""CAN adapters that speak SLCAN: lines of hexadecimal text to frames, frames to NMEA 2000 messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from seatrial.capture.decoders import LONGEST, Tables
from seatrial.capture.detection import SLCAN_FRAME
from seatrial.capture.piece_buffer import PieceBuffer

if TYPE_CHECKING:
    from ingest.canbus.frames import Frames

#: Frames of a packet that does not end are forgotten after so long, ns.
PATIENCE_NS = 2_000_000_000


@dataclass(frozen=True)
class Line:
    """One frame as text, and where its line ends."""

    can_id: int
    extended: bool
    data: bytes
    end: int


def lines(data: bytes) -> list[Line]:
    """Data frames in a stream of SLCAN; remote frames, answers and junk are passed over."""
    found = []
    for match in SLCAN_FRAME.finditer(data):
        text = match.group()
        digits = 8 if text[:1] == b"T" else 3
        size = int(text[1 + digits : 2 + digits])
        payload = bytes.fromhex(text[2 + digits : 2 + digits + 2 * size].decode())
        found.append(Line(int(text[1 : 1 + digits], 16), digits == 8, payload, match.end()))
    return found


class SlcanDecoder:
    """Decodes an SLCAN adapter on an NMEA 2000 network."""

    def __init__(self) -> None:
        self._buffer = PieceBuffer()
        self._waiting: Frames | None = None

    def feed(self, pieces: Sequence[tuple[int, bytes]]) -> Tables:
        """Tables per PGN."""
        self._buffer.add(pieces)
        data = self._buffer.data
        end = max(data.rfind(b"\r") + 1, len(data) - LONGEST)
        found = lines(data[:end])
        covered = sum(len(line.data) * 2 + (10 if line.extended else 5) + 1 for line in found)
        times = (
            self._buffer.times(np.array([line.end for line in found], np.int64))
            if found
            else np.empty(0, np.int64)
        )
        self._buffer.drop(end)
        decoded = self._decoded(frames_of(found, times)) if found else Tables()
        return Tables(
            decoded.tables,
            decoded.units,
            decoded.sources,
            len(found),
            max(0, end - covered) if not found else 0,
        )

    def _decoded(self, frames: Frames) -> Tables:
        from ingest.canbus.frames import Capture
        from ingest.canbus.reader import decoded
        from ingest.reader import ReadOptions

        ready, self._waiting = complete(joined(self._waiting, frames))
        try:
            found = decoded(Capture(ready, {}, (), 0, "utc"), ReadOptions())
        except ValueError:
            return Tables()
        return Tables(found.tables, found.units, found.sources)


def frames_of(found: Sequence[Line], times: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> Frames:
    """Frames as columns."""
    from ingest.canbus.frames import Frames

    data = np.zeros((len(found), 8), np.uint8)
    for row, line in zip(data, found, strict=True):
        row[: len(line.data)] = np.frombuffer(line.data, np.uint8)
    return Frames(
        times,
        np.array([line.can_id for line in found], np.uint32),
        np.array([line.extended for line in found], bool),
        np.zeros(len(found), np.int16),
        np.array([len(line.data) for line in found], np.uint8),
        data,
        ("can",),
    )


def joined(before: Frames | None, after: Frames) -> Frames:
    """Both, one after the other."""
    from ingest.canbus.frames import Frames

    if before is None or not len(before):
        return after
    return Frames(
        np.concatenate([before.time_ns, after.time_ns]),
        np.concatenate([before.can_id, after.can_id]),
        np.concatenate([before.extended, after.extended]),
        np.concatenate([before.channel, after.channel]),
        np.concatenate([before.dlc, after.dlc]),
        np.concatenate([before.data, after.data]),
        after.channels,
    )


def complete(frames: Frames) -> tuple[Frames, Frames]:
    """Split frames into those that can be decoded, and those of packets whose end has not come yet.

    The frames of a fast packet count up in the lower five bits of their first byte; the first of them has the
    packet's length in its second: six bytes of it there, seven in each that follows.
    """
    from ingest.canbus.layout import is_fast
    from ingest.canbus.n2k import pgn_of

    pgn = pgn_of(frames.can_id)
    fast = np.array([is_fast(int(p)) for p in np.unique(pgn)])[np.searchsorted(np.unique(pgn), pgn)]
    waiting = np.zeros(len(frames), bool)
    recent = frames.time_ns >= frames.time_ns[-1] - PATIENCE_NS
    for can_id in np.unique(frames.can_id[fast & frames.extended]):
        mine = np.flatnonzero(frames.can_id == can_id)
        starts = np.flatnonzero(frames.data[mine, 0] & 0x1F == 0)
        if not len(starts):
            continue
        last = mine[starts[-1] :]
        needed = 1 + max(0, -(-(int(frames.data[last[0], 1]) - 6) // 7))
        waiting[last] = len(last) < needed
    waiting &= recent
    return frames.take(~waiting), frames.take(waiting)
