"""MAVLink telemetry logs (``.tlog``): each frame after its time, eight bytes of big-endian microseconds."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ingest.log import Finding
from ingest.reader import Decoded, Reader, ReadOptions

STAMP = 8
#: Stamps from 2000-01-01 to 2100-01-01, in microseconds.
EARLIEST_US, LATEST_US = 946_684_800_000_000, 4_102_444_800_000_000
CANDIDATE = re.compile(rb"(?=(\x00[\x03-\x0e][\s\S]{6})[\xfd\xfe])")


def sniff(head: bytes) -> float:
    """Share of the head that is a chain of stamped frames, by their lengths alone."""
    best, done = chained(head), -1
    for match in CANDIDATE.finditer(head):
        if match.start() < done or best > len(head) // 2:
            continue
        end, frames = chain(head, match.start(), EARLIEST_US)
        if frames >= 3 or (frames and end >= len(head)):
            best, done = best + end - match.start(), end
    return min(1.0, best / max(len(head), 1))


def chained(head: bytes) -> int:
    """Bytes of a chain right from the start, even if the host did not know the date."""
    end, frames = chain(head, 0, 0)
    return end if frames >= 3 or (frames and end >= len(head)) else 0


def chain(head: bytes, p: int, earliest: int) -> tuple[int, int]:
    """Where stamped frames from ``p`` on end, and how many there are."""
    frames = 0
    while p + STAMP + 3 <= len(head) and head[p + STAMP] in (0xFD, 0xFE):
        stamp = int.from_bytes(head[p : p + STAMP], "big")
        if not earliest <= stamp < LATEST_US:
            break
        v2, length, flags = head[p + STAMP] == 0xFD, head[p + STAMP + 1], head[p + STAMP + 2]
        p += STAMP + length + (12 if v2 else 8) + (13 if v2 and flags & 1 else 0)
        frames += 1
    return p if p + STAMP + 3 <= len(head) else len(head), frames


def read(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
    """Decode a tlog."""
    from ingest.clock import continue_clock
    from ingest.damage import damage_findings, uncovered
    from ingest.detect import detect
    from ingest.mavlink.boot import boot_findings
    from ingest.mavlink.decode import Timed, decode_frames, field_units, loss_findings, unknown_findings
    from ingest.mavlink.dialect import DEFAULT, load_dialect
    from ingest.mavlink.frames import scan
    from ingest.mavlink.mavlink_rules import RULES, chosen_component

    dialect = load_dialect(str(options.dialect.get("mavlink", DEFAULT)))
    frames = scan(data, dialect, lead=STAMP)
    if not (frames.kind >= 0).any():
        raise ValueError(f"no MAVLink frame of the dialect {dialect.name} with a right checksum")
    start, end = frames.table["start"], frames.table["end"]
    t_ns, stamp_findings = stamps(data, start, end)
    t_ns, clock_findings = continue_clock(t_ns)
    tables = decode_frames(Timed(data, frames, t_ns), dialect, options.topics)
    offset, length = uncovered(start - STAMP, end, len(data))
    return Decoded(
        tables=tables,
        units=field_units(tables.keys(), dialect),
        utc_of_index_zero_ns=0 if EARLIEST_US * 1000 <= t_ns[0] < LATEST_US * 1000 else None,
        findings=(
            *damage_findings(np.column_stack([offset, length]), len(data)),
            *stamp_findings,
            *clock_findings,
            *boot_findings(tables),
            *unknown_findings(frames, dialect),
            *loss_findings(frames),
        ),
        messages=int((frames.kind >= 0).sum()),
        bytes_damaged=int(length.sum()),
        sources=chosen_component(detect(RULES, tables), tables),
    )


def stamps(
    data: memoryview, start: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[NDArray[np.int64], list[Finding]]:
    """Give times of frames; those whose stamp is lost or strays from its neighbours' are interpolated.

    Returns
    -------
    t_ns : (n,) int64
        Nanoseconds UTC.
    findings : list of Finding
    """
    from ingest.clock import mended
    from ingest.mavlink.frames import gather_stamps

    t = gather_stamps(np.frombuffer(data, dtype=np.uint8), np.ascontiguousarray(start))
    broken = t < 0
    broken[1:] |= start[1:] - end[:-1] < STAMP
    return mended(t, broken, start - STAMP)


TLOG = Reader("tlog", (".tlog",), sniff, read)
