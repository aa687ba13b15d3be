"""Live decoders: pieces of a port's stream in, tables of the records that they complete out.

They are those of the log readers; here is only what waits for its end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ingest.log import Source
from seatrial.capture.piece_buffer import PieceBuffer
from seatrial.capture.recognised import Recognised

if TYPE_CHECKING:
    import pandas as pd

#: The most that is kept of a record that does not end.
LONGEST = 8192


@dataclass(frozen=True)
class Tables:
    """What some pieces completed.

    Attributes
    ----------
    tables : mapping of str to DataFrame
        One per topic; index in nanoseconds as the pieces have them.
    units : mapping of (topic, column) to str
    sources : tuple of Source
        What looks like position, heading, …, of all that came lately; not all of it need be in these tables.
    messages, damaged : int
        Records decoded, and bytes that belong to none.
    settled : bool
        Whether so much has come that what is not among the sources is nothing known.
    """

    tables: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    units: Mapping[tuple[str, str], str] = field(default_factory=dict)
    sources: tuple[Source, ...] = ()
    messages: int = 0
    damaged: int = 0
    settled: bool = True


class Decoder(Protocol):
    """Decodes one port."""

    def feed(self, pieces: Sequence[tuple[int, bytes]]) -> Tables:
        """Tables of the records that the pieces (nanoseconds, bytes) complete."""


class SerialDecoder:
    """NMEA 0183, UBX and RTCM3, mixed as they come."""

    def __init__(self) -> None:
        from ingest.marine.rules import sources_of

        self._buffer = PieceBuffer()
        self._known = Recognised(sources_of)

    def feed(self, pieces: Sequence[tuple[int, bytes]]) -> Tables:
        """Tables per sentence and message."""
        from ingest.marine.stream import decode_stream

        self._buffer.add(pieces)
        try:
            stream = decode_stream(self._buffer.data, arrival=self._buffer.arrival)
        except ValueError:
            return Tables(damaged=self._forget(beginning(self._buffer.data)))
        end = stream.remainder
        hurt = [f for f in stream.findings if f.kind in ("damaged", "truncated") and f.offset is not None]
        damaged = sum(
            max(0, min(end, f.offset + (f.length or 0)) - f.offset) for f in hurt if f.offset is not None
        )
        self._buffer.drop(end)
        damaged += self._forget(0)
        self._known.add(stream.tables)
        found = self._known.sources, stream.messages, damaged, self._known.settled
        return Tables(stream.tables, stream.units, *found)

    def _forget(self, count: int) -> int:
        """Forget so many bytes, and more where too many are left; how many of them were no line ends."""
        count = max(count, len(self._buffer.data) - LONGEST)
        forgotten = self._buffer.data[:count]
        self._buffer.drop(count)
        return len(forgotten) - forgotten.count(b"\r") - forgotten.count(b"\n")


def beginning(data: bytes) -> int:
    """Where the first record of a stream without a whole one may begin."""
    array = np.frombuffer(data, np.uint8)
    marks = np.flatnonzero((array == 0x24) | (array == 0x21) | (array == 0xB5) | (array == 0xD3))
    return int(marks[0]) if len(marks) else len(data)


class MavlinkDecoder:
    """MAVLink 1 and 2."""

    def __init__(self) -> None:
        self._buffer = PieceBuffer()
        self._known = Recognised(mavlink_sources)

    def feed(self, pieces: Sequence[tuple[int, bytes]]) -> Tables:
        """Tables per message."""
        from ingest.damage import uncovered
        from ingest.mavlink.decode import Timed, decode_frames, field_units
        from ingest.mavlink.dialect import DEFAULT, load_dialect
        from ingest.mavlink.frames import scan
        from ingest.mavlink.stream import LONGEST as LONGEST_FRAME

        self._buffer.add(pieces)
        dialect, data = load_dialect(DEFAULT), self._buffer.data
        frames = scan(data, dialect)
        starts, ends = frames.table["start"], frames.table["end"]
        last = int(ends[-1]) if len(ends) else 0
        keep = max(last, len(data) - LONGEST_FRAME)
        _, lost = uncovered(starts, ends, last)
        tables = decode_frames(Timed(memoryview(data), frames, self._buffer.times(ends)), dialect)
        self._buffer.drop(keep)
        self._known.add(tables)
        count, damaged = int((frames.kind >= 0).sum()), int(lost.sum()) + keep - last
        units = field_units(tables.keys(), dialect)
        return Tables(tables, units, self._known.sources, count, damaged, self._known.settled)


def mavlink_sources(tables: Mapping[str, pd.DataFrame]) -> tuple[Source, ...]:
    """What the messages of an autopilot hold."""
    from ingest.detect import detect
    from ingest.mavlink.mavlink_rules import RULES, chosen_component

    return chosen_component(detect(RULES, tables), tables)


def decoder_for(protocol: str) -> Decoder | None:
    """The decoder of a protocol; None where there is nothing to decode."""
    from seatrial.capture.can_adapter import SlcanDecoder
    from seatrial.capture.imu_text import ImuDecoder

    kinds: dict[str, Callable[[], Decoder]] = {
        "nmea": SerialDecoder,
        "ubx": SerialDecoder,
        "mavlink": MavlinkDecoder,
        "slcan": SlcanDecoder,
        "imu": ImuDecoder,
    }
    return kinds[protocol]() if protocol in kinds else None
