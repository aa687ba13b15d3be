"""MAVLink without a file: bytes as they arrived at a port and were recorded, to tables.

The decoder is that of the tlog; only where the times come from differs.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike

from ingest.damage import damage_findings, uncovered
from ingest.detect import detect
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
        findings=(
            *damage_findings(np.column_stack([offset, length]), len(data)),
            *unknown_findings(frames, known),
        ),
        messages=int((frames.kind >= 0).sum()),
        bytes_damaged=int(length.sum()),
        sources=chosen_component(detect(RULES, tables), tables),
    )
