"""MAVLink without a file: bytes as they arrived, from a live port or a recorded channel, to tables.

The decoder is that of the tlog; only where the times come from differs.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ingest.detect import detect
from ingest.mavlink.damage import damage_findings, uncovered
from ingest.mavlink.decode import Timed, decode_frames, field_units, unknown_findings
from ingest.mavlink.dialect import DEFAULT, load_dialect
from ingest.mavlink.frames import scan
from ingest.mavlink.mavlink_rules import RULES, chosen_component
from ingest.reader import Decoded

#: No frame is longer: header, payload, checksum, signature.
LONGEST = 10 + 255 + 2 + 13


def decode_stream(
    data: memoryview | bytes,
    chunk_offset: ArrayLike,
    chunk_ns: ArrayLike,
    dialect: str = DEFAULT,
    topics: Collection[str] | None = None,
) -> Decoded:
    """Decode a stream of frames that arrived in chunks.

    Parameters
    ----------
    data : bytes-like
        All chunks, one after the other.
    chunk_offset : (n,) int
        Where each chunk starts, rising from 0.
    chunk_ns : (n,) int
        When it arrived, nanoseconds. A frame has the time of the chunk that completed it.
    dialect : str
        As pymavlink names it.
    topics : collection of str, optional
        Decode only these.

    Raises
    ------
    ValueError
        No frame with a right checksum.
    """
    offsets = np.asarray(chunk_offset, dtype=np.int64)
    known = load_dialect(dialect)
    frames = scan(data, known)
    if not (frames.kind >= 0).any():
        raise ValueError(f"no MAVLink frame of the dialect {dialect} with a right checksum")
    start, end = frames.table["start"], frames.table["end"]
    chunk = np.searchsorted(offsets, end - 1, side="right") - 1
    t_ns = np.asarray(chunk_ns, dtype=np.int64)[chunk]
    tables = decode_frames(Timed(memoryview(data), frames, t_ns), known, topics)
    offset, length = uncovered(start, end, len(data))
    return Decoded(
        tables=tables,
        units=field_units(tables.keys(), known),
        findings=(*damage_findings(offset, length, len(data), True), *unknown_findings(frames, known)),
        messages=int((frames.kind >= 0).sum()),
        bytes_damaged=int(length.sum()),
        sources=chosen_component(detect(RULES, tables), tables),
    )


@dataclass
class LiveStream:
    """Decode a live port: bytes in, tables of the frames that they complete out.

    Attributes
    ----------
    dialect : str
    messages, bytes_damaged : int
        Counts so far.
    """

    dialect: str = DEFAULT
    messages: int = 0
    bytes_damaged: int = 0
    _rest: bytes = field(default=b"", repr=False)

    def feed(self, data: bytes, t_ns: int) -> dict[str, pd.DataFrame]:
        """Tables of the frames that ``data``, which arrived at ``t_ns``, completes."""
        known = load_dialect(self.dialect)
        pending = self._rest + data
        frames = scan(pending, known)
        ends = frames.table["end"]
        last = int(ends[-1]) if len(ends) else 0
        keep = max(last, len(pending) - LONGEST)
        _, lost = uncovered(frames.table["start"], ends, last)
        self.bytes_damaged += int(lost.sum()) + keep - last
        self.messages += int((frames.kind >= 0).sum())
        self._rest = pending[keep:]
        times = np.full(len(ends), t_ns, dtype=np.int64)
        return decode_frames(Timed(memoryview(pending), frames, times), known)
