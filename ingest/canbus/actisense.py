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

from ingest.canbus.damage import damage_findings, merged
from ingest.canbus.frames import Capture, Frames, Packets, no_frames
from ingest.canbus.layout import is_fast
from ingest.canbus.lines import NOT_HEX, LineStyle, Stretch, clock_ns, date_time_ns, stretches

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
    frames, packets = sorted_out(Rows.joined(rows))
    clock = "day" if not canboat else "utc" if ZONED.search(head) else "start"
    return Capture(frames, packets, findings, sum(n for _, n in damaged), clock)


@dataclass(frozen=True)
class Rows:
    """Lines as columns: time, PGN, source (n,), and one payload each."""

    time_ns: NDArray[np.int64]
    pgn: NDArray[np.int64]
    source: NDArray[np.uint8]
    payloads: list[bytes]

    @staticmethod
    def joined(parts: list[Rows]) -> Rows:
        """Rows of several chunks, one after the other."""
        return Rows(
            np.concatenate([np.empty(0, np.int64), *(p.time_ns for p in parts)]),
            np.concatenate([np.empty(0, np.int64), *(p.pgn for p in parts)]),
            np.concatenate([np.empty(0, np.uint8), *(p.source for p in parts)]),
            [payload for p in parts for payload in p.payloads],
        )


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
    return Rows(time_ns[whole], pgn[whole], source[whole].astype(np.uint8), kept), whole


def colons(stamp: bytes) -> bytes:
    """``hhmmss.fff`` as ``hh:mm:ss.fff``."""
    return b":".join((stamp[:2], stamp[2:4], stamp[4:]))


def sorted_out(rows: Rows) -> tuple[Frames, dict[int, Packets]]:
    """Packets by PGN; lines that are single frames of fast packets as frames."""
    size = np.array([len(p) for p in rows.payloads], np.int64)
    packets: dict[int, Packets] = {}
    loose = np.zeros(len(size), np.bool_)
    assembled = bool((size > 8).any())
    for pgn in np.unique(rows.pgn).tolist():
        index = np.flatnonzero(rows.pgn == pgn)
        if is_fast(pgn) and not assembled:
            loose[index] = True
        else:
            packets[pgn] = packets_of(rows, index, size[index])
    return (frames_of_rows(rows, np.flatnonzero(loose), size) if loose.any() else no_frames()), packets


def packets_of(rows: Rows, index: NDArray[np.int64], size: NDArray[np.int64]) -> Packets:
    """The packets of the rows that ``index`` selects."""
    width = int(size.max(initial=1))
    block = b"".join(rows.payloads[i].ljust(width, b"\0") for i in index.tolist())
    payload = np.frombuffer(block, np.uint8).reshape(-1, width)
    return Packets(rows.time_ns[index], rows.source[index], size, payload)


def frames_of_rows(rows: Rows, index: NDArray[np.int64], size: NDArray[np.int64]) -> Frames:
    """The rows that ``index`` selects as CAN frames."""
    block = b"".join(rows.payloads[i].ljust(8, b"\0") for i in index.tolist())
    pgn, source = rows.pgn[index], rows.source[index]
    return Frames(
        rows.time_ns[index],
        (pgn << 8 | source).astype(np.uint32),
        np.ones(len(index), np.bool_),
        np.zeros(len(index), np.int16),
        size[index].astype(np.uint8),
        np.frombuffer(block, np.uint8).reshape(-1, 8),
    )
