"""Text of inertial sensors: VectorNav's sentences, or lines of numbers, with names or without.

``#YPR=12.3,-1.0,0.4``, ``!ANG:1.2,3.4,5.6``, ``yaw:12.3 pitch:-1.0 roll:0.4``, ``1.0, 2.0, 3.0``.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence

from seatrial.capture.decoders import LONGEST, SerialDecoder, Tables
from seatrial.capture.piece_buffer import PieceBuffer

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_NAMED = re.compile(rf"([A-Za-z_]\w*)\s*[:=]\s*({_NUMBER})(?![\d.,]*,)")
_LINE = re.compile(
    rf"[#!$]?(?P<label>[A-Za-z_]\w*)?\s*[:=,]?\s*(?P<values>{_NUMBER}(?:\s*[,;\s]\s*{_NUMBER})+)"
)
_VALUE = re.compile(_NUMBER)

Row = dict[str, float]


def parsed(line: str) -> tuple[str, Row] | None:
    """Label and values of a line; None where it is no line of numbers."""
    line = line.strip().rstrip(",;")
    named = _NAMED.findall(line)
    if len(named) >= 2:
        return "IMU", {name: float(value) for name, value in named}
    found = _LINE.fullmatch(line)
    if found is None:
        return None
    values = [float(v) for v in _VALUE.findall(found["values"])]
    return found["label"] or "IMU", {f"value[{i}]": v for i, v in enumerate(values)}


class ImuDecoder:
    """Decodes a port that sends text of an inertial sensor."""

    def __init__(self) -> None:
        self._buffer = PieceBuffer()
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
        import numpy as np
        import pandas as pd

        end = max(self._buffer.data.rfind(b"\n") + 1, len(self._buffer.data) - LONGEST)
        rows: dict[str, list[Row]] = defaultdict(list)
        places: dict[str, list[int]] = defaultdict(list)
        damaged, at = 0, 0
        for raw in self._buffer.data[:end].splitlines(keepends=True):
            at += len(raw)
            found = parsed(raw.decode("latin-1"))
            if found is None:
                damaged += len(raw) if raw.strip() else 0
                continue
            rows[found[0]].append(found[1])
            places[found[0]].append(at)
        times = {label: self._buffer.times(np.array(ends, np.int64)) for label, ends in places.items()}
        self._buffer.drop(end)
        tables = {t: pd.DataFrame(r, index=pd.Index(times[t], name="t_ns")) for t, r in rows.items()}
        return Tables(tables, messages=sum(map(len, rows.values())), damaged=damaged)
