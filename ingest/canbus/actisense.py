"""Text of Actisense and canboat: one whole packet per line, as its programs print it.

``2026-08-03T05:05:27.983Z,2,129026,52,255,8,ff,fc,f5,bf,3f,01,ff,ff`` (canboat; fast packets assembled, or
frame by frame in its PLAIN variant) and ``A173321.107 23FF7 1F513 012F3070002F3070`` (Actisense N2K ASCII).
"""

from __future__ import annotations

import re
from binascii import unhexlify
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ingest.canbus.frames import Capture, Frames, Packets, no_frames
from ingest.canbus.lines import NOT_HEX, LineStyle, Stretch, clock_ns, date_time_ns, stretches
from ingest.canbus.stamps import repaired_times
from ingest.damage import damage_findings, merged
from ingest.log import Finding

IDLE = re.compile(rb"[ \t]*#[^\r\n]*")
CANBOAT = LineStyle(
    re.compile(
        rb"(?P<time>\d{4}-\d\d-\d\d[T\-Z ]\d\d:\d\d:\d\d(?:\.\d{1,9})?)Z?,(?P<priority>[0-7]),"
        rb"(?P<pgn>\d{5,6}),"
        rb"(?P<source>\d{1,3}),(?P<destination>\d{1,3}),(?P<dlc>\d{1,3}),"
        rb"(?P<data>[0-9A-Fa-f]{2}(?:,[0-9A-Fa-f]{2}(?![\w\-]))*)"
    ),
    IDLE,
)
ASCII = LineStyle(
    re.compile(
        rb"\bA(?P<time>\d{6}\.\d{1,6}) (?P<source>[0-9A-Fa-f]{2})(?P<destination>[0-9A-Fa-f]{2})"
        rb"(?P<priority>[0-7])"
        rb" (?P<pgn>[0-9A-Fa-f]{5}) (?P<data>(?:[0-9A-Fa-f]{2})+)(?=\s|$)"
    ),
    IDLE,
    base=10,
)
ZONED = re.compile(rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d{1,9})?Z,")


def sniff(head: bytes) -> float:
    """How sure the first bytes are of canboat or Actisense text."""
    count = max(len(s.record.findall(head[:8192])) for s in (CANBOAT, ASCII))
    return 0.95 if count >= 2 else 0.4 * count


def read(data: memoryview) -> Capture:
    """Packets of a canboat or Actisense text; frames, where fast packets are not assembled."""
    head = bytes(data[: 1 << 16])
    canboat = len(CANBOAT.record.findall(head)) >= len(ASCII.record.findall(head))
    rows: list[Rows] = []
    damaged: list[tuple[int, int]] = []
    for piece in stretches(data, CANBOAT if canboat else ASCII):
        part, whole = rows_of(piece, canboat)
        rows.append(part)
        damaged += piece.damaged + [s for s, ok in zip(piece.spans, whole.tolist(), strict=True) if not ok]
    findings = damage_findings(merged(damaged), len(data), "no canboat record")
    clock = "day" if not canboat else "utc" if ZONED.search(head) else "start"
    whole_log, notes = on_one_clock(Rows.joined(rows), clock)
    frames, packets = sorted_out(whole_log)
    return Capture(frames, packets, (*findings, *notes), sum(n for _, n in damaged), clock)


def on_one_clock(rows: Rows, clock: str) -> tuple[Rows, tuple[Finding, ...]]:
    """The lines with continuous times, without those whose stamp is damaged."""
    time_ns, kept, findings = repaired_times(rows.time_ns, clock)
    block = rows.block if kept.all() else rows.block[np.repeat(kept, rows.size)]
    return Rows(time_ns, rows.pgn[kept], rows.source[kept], rows.size[kept], block), findings


@dataclass(frozen=True)
class Rows:
    """Lines as columns: time, PGN, source, size of the payload (n,); ``block`` holds all payloads."""

    time_ns: NDArray[np.int64]
    pgn: NDArray[np.int64]
    source: NDArray[np.uint8]
    size: NDArray[np.int64]
    block: NDArray[np.uint8]

    @staticmethod
    def joined(parts: list[Rows]) -> Rows:
        """Rows of several chunks, one after the other."""
        return Rows(
            np.concatenate([np.empty(0, np.int64), *(p.time_ns for p in parts)]),
            np.concatenate([np.empty(0, np.int64), *(p.pgn for p in parts)]),
            np.concatenate([np.empty(0, np.uint8), *(p.source for p in parts)]),
            np.concatenate([np.empty(0, np.int64), *(p.size for p in parts)]),
            np.concatenate([np.empty(0, np.uint8), *(p.block for p in parts)]),
        )

    def payloads(self, index: NDArray[np.int64], width: int) -> NDArray[np.uint8]:
        """Payloads of the lines that ``index`` selects, 0 beyond their ends; (lines, width)."""
        start, size = (np.cumsum(self.size) - self.size)[index], self.size[index]
        place = np.arange(width)
        inside = place < size[:, None]
        taken = self.block[np.where(inside, start[:, None] + place, 0)] if len(self.block) else inside
        return np.where(inside, taken, 0).astype(np.uint8)


def rows_of(piece: Stretch, canboat: bool) -> tuple[Rows, NDArray[np.bool_]]:
    """The lines of one chunk, and which had as many bytes as they said."""
    groups = piece.groups
    base = 10 if canboat else 16
    payloads = [unhexlify(d.translate(None, NOT_HEX)) for d in groups["data"]]
    source = np.array([int(s, base) for s in groups["source"]], np.int64)
    whole = source < 256
    if canboat:
        whole &= np.array([len(p) == int(n) for p, n in zip(payloads, groups["dlc"], strict=True)], np.bool_)
    time_ns = date_time_ns(groups["time"]) if canboat else clock_ns([colons(t) for t in groups["time"]])
    pgn = np.array([int(p, base) for p in groups["pgn"]], np.int64)
    kept = [p for p, ok in zip(payloads, whole.tolist(), strict=True) if ok]
    size = np.array([len(p) for p in kept], np.int64)
    block = np.frombuffer(b"".join(kept), np.uint8)
    return Rows(time_ns[whole], pgn[whole], source[whole].astype(np.uint8), size, block), whole


def colons(stamp: bytes) -> bytes:
    """``hhmmss.fff`` as ``hh:mm:ss.fff``."""
    return b":".join((stamp[:2], stamp[2:4], stamp[4:]))


def sorted_out(rows: Rows) -> tuple[Frames, dict[int, Packets]]:
    """Packets by PGN; lines that are single frames of fast packets as frames."""
    from ingest.canbus.layout import is_fast

    packets: dict[int, Packets] = {}
    loose = np.zeros(len(rows.pgn), np.bool_)
    assembled = bool((rows.size > 8).any())
    for pgn in np.unique(rows.pgn).tolist():
        index = np.flatnonzero(rows.pgn == pgn)
        if is_fast(pgn) and not assembled:
            loose[index] = True
        else:
            packets[pgn] = packets_of(rows, index)
    return (frames_of_rows(rows, np.flatnonzero(loose)) if loose.any() else no_frames()), packets


def packets_of(rows: Rows, index: NDArray[np.int64]) -> Packets:
    """The packets of the lines that ``index`` selects."""
    size = rows.size[index]
    payload = rows.payloads(index, int(size.max(initial=1)))
    return Packets(rows.time_ns[index], rows.source[index], size, payload)


def frames_of_rows(rows: Rows, index: NDArray[np.int64]) -> Frames:
    """The lines that ``index`` selects as CAN frames."""
    identifier = rows.pgn[index] << 8 | rows.source[index]
    return Frames(
        rows.time_ns[index],
        identifier.astype(np.uint32),
        np.ones(len(index), np.bool_),
        np.zeros(len(index), np.int16),
        rows.size[index].astype(np.uint8),
        rows.payloads(index, 8),
    )
