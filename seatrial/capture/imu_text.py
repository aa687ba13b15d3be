"""Text of inertial sensors: lines of numbers as the log readers take them, or VectorNav's sentences."""

from __future__ import annotations

from collections.abc import Sequence

from seatrial.capture.decoders import LONGEST, SerialDecoder, Tables
from seatrial.capture.piece_buffer import PieceBuffer
from seatrial.capture.recognised import Recognised


class ImuDecoder:
    """Decodes a port that sends text of an inertial sensor."""

    def __init__(self) -> None:
        from ingest.marine.imu_text import sources_of

        self._buffer = PieceBuffer()
        self._known = Recognised(sources_of)
        self._sentences: SerialDecoder | None = None

    def feed(self, pieces: Sequence[tuple[int, bytes]]) -> Tables:
        """Tables per label."""
        if self._sentences is None and any(b"$VN" in data for _, data in pieces):
            self._sentences = SerialDecoder()
        if self._sentences is not None:
            return self._sentences.feed(pieces)
        self._buffer.add(pieces)
        return self._lines()

    def _lines(self) -> Tables:
        import pandas as pd

        from ingest.marine.imu_text import read_lines

        data = self._buffer.data
        whole = data.rfind(b"\n") + 1
        end = max(whole, len(data) - LONGEST)
        text = read_lines(data)
        tables = {
            label: table.set_axis(pd.Index(self._buffer.times(ends), name="t_ns"), axis=0)
            for label, (table, ends) in text.tables.items()
        }
        self._buffer.drop(end)
        damaged = int((text.damage[:, 1] - text.damage[:, 0]).sum()) + end - whole
        self._known.add(tables)
        count = sum(map(len, tables.values()))
        return Tables(tables, {}, self._known.sources, count, damaged, self._known.settled)
