"""Vector BLF: objects in compressed containers, found by their signature, so damage costs only itself.

The header gives the start in local time of an unknown zone (Vector) or in UTC (python-can); nothing tells
which, so times count from the start only.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ingest.canbus.candump import other_frames
from ingest.canbus.frames import Capture, Frames, joined
from ingest.damage import damage_findings, merged
from ingest.log import Finding

SIGNATURE = re.compile(rb"LOBJ")
FILE_HEADER = struct.Struct("<4sL")
OBJECT_HEADER = struct.Struct("<4sHHLL")
CONTAINER_HEADER = struct.Struct("<H6xL4x")
SYSTEM_TIME = struct.Struct("<8H")
START_AT = 40
CONTAINER, CAN_MESSAGE, CAN_MESSAGE2, OTHER_CAN = 10, 1, 86, (73, 100, 101)
TEN_MICROSECONDS = 1
#: A container says how much it unpacks to; more than this is a lie.
LARGEST_CONTAINER = 64 << 20
#: What is left of an object at the end of a container is kept for the next, up to this length.
LONGEST_OBJECT = 1 << 20
#: A CAN message object: header (version 1 or 2: 32 bytes of it), then the message.
OBJECT = np.dtype(
    {
        "names": [
            "header",
            "version",
            "size",
            "type",
            "flags",
            "time",
            "channel",
            "kind",
            "dlc",
            "id",
            "data",
        ],
        "formats": ["<u2", "<u2", "<u4", "<u4", "<u4", "<i8", "<u2", "u1", "u1", "<u4", "(8,)u1"],
        "offsets": [4, 6, 8, 12, 16, 24, 32, 34, 35, 36, 40],
        "itemsize": 48,
    }
)
REMOTE, EXTENDED = 0x80, 0x8000_0000


def sniff(head: bytes) -> float:
    """How sure the first bytes are of BLF."""
    return 1.0 if head.startswith(b"LOGG") else 0.9 if head.startswith(b"LOBJ") else 0.0


def read(data: memoryview) -> Capture:
    """Frames of a BLF file."""
    parts, damaged, other = [], [], 0
    tail = b""
    for piece in pieces(data):
        if piece.broken:
            damaged.append((piece.offset, piece.length))
        text = tail + piece.content
        frames, end, holes, passed = objects(text)
        tail = text[end:] if len(text) - end <= LONGEST_OBJECT else b""
        if holes or len(text) - end > LONGEST_OBJECT:
            damaged.append((piece.offset, piece.length))
        parts.append(frames)
        other += passed
    spans = merged([s for s in damaged if s[1]])
    findings = (
        *damage_findings(spans, len(data), "damaged BLF objects"),
        *other_frames(other),
        *start_notes(data),
    )
    return Capture(joined(parts), {}, findings, sum(n for _, n in spans), "start")


def start_notes(data: memoryview) -> tuple[Finding, ...]:
    """What the header says of the start, for a person."""
    if len(data) < START_AT + SYSTEM_TIME.size or bytes(data[:4]) != b"LOGG":
        return ()
    year, month, _, day, hour, minute, second, _ = SYSTEM_TIME.unpack_from(data, START_AT)
    if not year:
        return ()
    said = f"{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}"
    return (
        Finding("clock", f"the log says that it began {said}, local time or UTC, which is unknown: not used"),
    )


@dataclass(frozen=True)
class Piece:
    """Unpacked content of one object of the file; its place in the file; whether some of it is lost."""

    offset: int
    length: int
    content: bytes
    broken: bool = False


def pieces(data: memoryview) -> Iterator[Piece]:
    """The objects of the file, unpacked; what lies between them is a broken piece."""
    at = FILE_HEADER.unpack_from(data)[1] if bytes(data[:4]) == b"LOGG" and len(data) >= 8 else 0
    at = min(at, len(data))
    while at < len(data):
        found = SIGNATURE.search(data, at)
        start = found.start() if found else len(data)
        if start - at > 3 or (found is None and bytes(data[at:]).strip(b"\0")):
            yield Piece(at, start - at, b"", True)
        if found is None or start + OBJECT_HEADER.size > len(data):
            if found is not None:
                yield Piece(start, len(data) - start, b"", True)
            return
        piece = unpacked(data, start)
        yield piece
        at = start + piece.length


def unpacked(data: memoryview, start: int) -> Piece:
    """The object at ``start``; one whose length cannot be right ends before the next."""
    _, _, _, size, kind = OBJECT_HEADER.unpack_from(data, start)
    size = size if size >= OBJECT_HEADER.size else OBJECT_HEADER.size
    end = min(start + size, len(data))
    cut = start + size > len(data)
    if end + 7 < len(data) and SIGNATURE.search(data, end, end + 8) is None:
        following = SIGNATURE.search(data, start + 4)
        cut, end = True, following.start() if following else len(data)
    if kind != CONTAINER:
        return Piece(start, end - start, bytes(data[start:end]), cut)
    body = start + OBJECT_HEADER.size
    if body + CONTAINER_HEADER.size > len(data):
        return Piece(start, len(data) - start, b"", True)
    method, _ = CONTAINER_HEADER.unpack_from(data, body)
    packed = bytes(data[body + CONTAINER_HEADER.size : end])
    content, whole = (packed, True) if method == 0 else inflated(packed)
    return Piece(start, end - start, content, cut or not whole)


def inflated(packed: bytes) -> tuple[bytes, bool]:
    """What zlib can unpack, and whether that is all."""
    engine = zlib.decompressobj()
    try:
        content = engine.decompress(packed, LARGEST_CONTAINER)
    except zlib.error:
        return salvaged(packed), False
    return content, engine.eof


def salvaged(packed: bytes, step: int = 64) -> bytes:
    """What zlib unpacks up to the damage."""
    engine = zlib.decompressobj()
    out, size = [], 0
    try:
        for i in range(0, len(packed), step):
            if size >= LARGEST_CONTAINER:
                break
            out.append(engine.decompress(packed[i : i + step], LARGEST_CONTAINER - size))
            size += len(out[-1])
    except zlib.error:
        pass
    return b"".join(out)


def objects(content: bytes) -> tuple[Frames, int, bool, int]:
    """CAN data frames in unpacked content.

    Returns
    -------
    frames : Frames
    end : int
        Where an object begins that is not complete.
    holes : bool
        Whether there is anything between the objects.
    other : int
        Number of remote, error and CAN FD frames.
    """
    text = np.frombuffer(content, np.uint8)
    at, head = candidates(text)
    ends = at + head["size"].astype(np.int64)
    whole = ends <= len(text)
    at, head, ends = at[whole], head[whole], ends[whole]
    outer = np.maximum.accumulate(np.concatenate([[0], ends[:-1]])) <= at
    at, head, ends = at[outer], head[outer], ends[outer]
    holes = bool((at[1:] - ends[:-1] > 7).any()) or bool(len(at) and at[0] > 7)
    end = int(ends[-1]) if len(at) else 0
    message = np.isin(head["type"], (CAN_MESSAGE, CAN_MESSAGE2)) & (head["size"] >= OBJECT.itemsize)
    classic = message & (head["kind"] & REMOTE == 0) & (head["dlc"] <= 8)
    other = int((message & ~classic).sum() + np.isin(head["type"], OTHER_CAN).sum())
    return frames_of(head[classic]), end, holes, other


def candidates(text: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.void]]:
    """Offsets and heads of everything that looks like an object."""
    room = len(text) - 15
    if room <= 0:
        return np.empty(0, np.int64), np.empty(0, OBJECT)
    first = np.flatnonzero(text[:room] == ord("L"))
    for k, letter in enumerate(b"OBJ", start=1):
        first = first[text[first + k] == letter]
    padded = np.concatenate([text, np.zeros(OBJECT.itemsize, np.uint8)])
    head = padded[first[:, None] + np.arange(OBJECT.itemsize)].view(OBJECT)[:, 0]
    sane = (head["header"] >= 16) & (head["size"] >= head["header"]) & (head["size"] <= LARGEST_CONTAINER)
    return first[sane], head[sane]


def frames_of(head: NDArray[np.void]) -> Frames:
    """The frames of CAN message objects."""
    unit = np.where(head["flags"] == TEN_MICROSECONDS, 10_000, 1)
    ports, channel = np.unique(head["channel"], return_inverse=True)
    inside = np.arange(8) < head["dlc"][:, None]
    return Frames(
        head["time"] * unit,
        head["id"] & np.uint32(0x1FFF_FFFF),
        (head["id"] & np.uint32(EXTENDED)) != 0,
        channel.astype(np.int16),
        head["dlc"].astype(np.uint8),
        np.where(inside, head["data"], 0).astype(np.uint8),
        tuple(str(int(p) - 1) for p in ports) or ("",),
    )
