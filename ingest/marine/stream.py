"""Serial bytes to tables: the one door for files, live ports and the raw channels of captures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import Finding
from ingest.marine.accuracy import with_accuracy
from ingest.marine.epochs import UNKNOWN, Timeline, timeline
from ingest.marine.rules import units_of
from ingest.marine.scan import RTCM3, Bytes, Records, scan
from ingest.marine.sentences import Rows, sentence_rows
from ingest.marine.stamps import Stamps, host_stamps
from ingest.marine.ubx import Messages, message_rows
from ingest.repeats import repeated, said

#: Damaged stretches beyond so many are counted in one finding.
MOST_FINDINGS = 10_000


@dataclass(frozen=True)
class Stream:
    """What serial bytes held.

    Attributes
    ----------
    tables : mapping of str to DataFrame
        One per formatter or message (``GGA``, ``NAV-PVT``); index in nanoseconds.
    units : mapping of (topic, field) to str
    utc_of_zero : int, optional
        UTC at index 0.
    findings : tuple of Finding
    messages, bytes_damaged : int
    unsure : mapping of str to float
        By how many seconds all rows of a topic may be early or late together, where only their order tells when.
    of_day_of_zero : int, optional
        Time of day at index 0, where that is known and no date is.
    remainder : int
        Where an unfinished record at the end may begin; a live port keeps the bytes from there on.
    """

    tables: dict[str, pd.DataFrame]
    units: dict[tuple[str, str], str] = field(default_factory=dict)
    utc_of_zero: int | None = None
    findings: tuple[Finding, ...] = ()
    messages: int = 0
    bytes_damaged: int = 0
    remainder: int = 0
    unsure: dict[str, float] = field(default_factory=dict)
    of_day_of_zero: int | None = None


def decode_stream(
    data: Bytes | bytes | memoryview,
    arrival: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None,
    topics: frozenset[str] | None = None,
) -> Stream:
    """Decode NMEA 0183, UBX and RTCM3 (skipped), interleaved as they come.

    Parameters
    ----------
    data : bytes-like
        The stream.
    arrival : (offsets, times), optional
        Where each piece of the stream began, and when it arrived (ns, UTC): for bytes from a port.
    topics : set of str, optional
        Decode only these.

    Raises
    ------
    ValueError
        Where there is no record, or no time.
    """
    array = data if isinstance(data, np.ndarray) else np.frombuffer(data, np.uint8)
    records = scan(array)
    if not len(records.kind):
        raise ValueError("no NMEA sentence or UBX frame with a right checksum")
    placed = _placed(array, records, arrival, topics)
    twice = _twice(array, records, placed) if arrival is None else np.zeros(0, bool)
    if twice.any():
        records = records.without(twice)
        placed = _placed(array, records, arrival, topics)
    sentences, messages, line = placed.sentences, placed.messages, placed.line
    tables = {}
    decoded = {t: (r.table, r.record) for t, r in sentences.items()}
    decoded |= {t: (m.table, m.record) for t, m in messages.items()}
    for topic, (table, record) in decoded.items():
        if topics is None or topic in topics:
            tables[topic] = table.set_axis(pd.Index(line.ns[record], dtype="int64", name="t_ns"), axis=0)
    tables = with_accuracy(tables)
    damage, bad = damage_findings(array, records)
    return Stream(
        tables=tables,
        units=units_of(tables),
        utc_of_zero=line.utc_of_zero,
        findings=(*damage, *_skipped(records), *said(twice), *placed.notes, *line.findings),
        messages=len(records.kind),
        bytes_damaged=bad,
        remainder=_remainder(array, records),
        unsure=_unsure(line, {topic: record for topic, (_, record) in decoded.items() if topic in tables}),
        of_day_of_zero=line.of_day_of_zero,
    )


@dataclass(frozen=True)
class _Placed:
    """What records hold, when, and by which stamps of the host (None without)."""

    sentences: Mapping[str, Rows]
    messages: Mapping[str, Messages]
    notes: Sequence[Finding]
    host: Stamps | None
    line: Timeline


def _placed(
    array: Bytes,
    records: Records,
    arrival: tuple[NDArray[np.int64], NDArray[np.int64]] | None,
    topics: frozenset[str] | None,
) -> _Placed:
    host = _arrivals(records, arrival) if arrival is not None else host_stamps(array, records)
    sentences, notes = sentence_rows(array, records, topics)
    messages = message_rows(array, records, topics)
    return _Placed(sentences, messages, notes, host, timeline(len(records.kind), sentences, messages, host))


def _twice(array: Bytes, records: Records, placed: _Placed) -> NDArray[np.bool_]:
    """Which records (n,) are those before them once more."""
    host, stated = placed.host, placed.line.stated
    times, known = (stated, stated != UNKNOWN) if host is None else (host.ns, host.good)

    def alike(a: int, b: int, count: int) -> bool:
        if b + count > len(records.start):
            return False
        of_a, of_b = (array[records.start[k] : records.end[k + count - 1]] for k in (a, b))
        return np.array_equal(of_a, of_b)

    return repeated(times, known, alike)


def _unsure(line: Timeline, records: Mapping[str, NDArray[np.int64]]) -> dict[str, float]:
    """By how many seconds a topic may be early or late as a whole: the median over its rows, where it is any."""
    if line.unsure is None:
        return {}
    found = {topic: float(np.median(line.unsure[rows])) for topic, rows in records.items() if len(rows)}
    return {topic: half for topic, half in found.items() if half > 0.0}


def _arrivals(records: Records, arrival: tuple[NDArray[np.int64], NDArray[np.int64]]) -> Stamps:
    offsets, times = arrival
    piece = np.searchsorted(offsets, records.end - 1, side="right") - 1
    return Stamps(times[np.clip(piece, 0, len(times) - 1)], np.ones(len(records.kind), bool), utc=True)


def _skipped(records: Records) -> list[Finding]:
    skipped = int((records.kind == RTCM3).sum())
    text = f"{skipped} RTCM3 frames (corrections, not needed) were skipped"
    return [Finding("note", text, count=skipped)] if skipped else []


def damage_findings(data: Bytes, records: Records) -> tuple[list[Finding], int]:
    """One finding per damaged stretch, and the number of bytes in them."""
    ranges = records.damage
    findings = [_stretch(data, int(a), int(b), records) for a, b in ranges[:MOST_FINDINGS]]
    if len(ranges) > MOST_FINDINGS:
        rest = len(ranges) - MOST_FINDINGS
        findings.append(Finding("damaged", f"{rest} more damaged stretches", count=rest))
    return findings, int((ranges[:, 1] - ranges[:, 0]).sum())


def _stretch(data: Bytes, a: int, b: int, records: Records) -> Finding:
    if b == len(data) and data[a] in (0x24, 0x21, 0xB5, 0xD3):
        return Finding("truncated", "the last record is cut off", offset=a, length=b - a)
    if len(records.start) and b <= records.start[0] and a == 0:
        return Finding("truncated", "begins in the middle of a record", offset=a, length=b - a)
    wrong = bool((data[a:b] == 0x2A).any())
    text = "wrong checksum" if wrong else f"{b - a} bytes that belong to no record"
    return Finding("damaged", text, offset=a, length=b - a)


def _remainder(data: Bytes, records: Records) -> int:
    """Start of an unfinished record after the last whole one; the length of the stream if there is none."""
    after = int(records.end[-1]) if len(records.end) else 0
    tail = data[after:]
    marks = np.flatnonzero((tail == 0x24) | (tail == 0x21) | (tail == 0xB5) | (tail == 0xD3))
    return after + int(marks[0]) if len(marks) else len(data)
