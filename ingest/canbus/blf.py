"""Vector BLF: objects in compressed containers, found by their signature, so damage costs only itself.

The header gives the start in local time of an unknown zone (Vector) or in UTC (python-can); nothing tells
which, so times count from the start only.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

from ingest.canbus.blf_objects import LARGEST_CONTAINER, LONGEST_OBJECT, believed, objects, sound
from ingest.canbus.candump import other_frames
from ingest.canbus.frames import Capture, joined, no_frames
from ingest.damage import damage_findings, merged
from ingest.log import Finding

SIGNATURE = re.compile(rb"LOBJ")
FILE_HEADER = struct.Struct("<4sL")
OBJECT_HEADER = struct.Struct("<4sHHLL")
CONTAINER_HEADER = struct.Struct("<H6xL4x")
SYSTEM_TIME = struct.Struct("<8H")
START_AT = 40
CONTAINER = 10
#: Bytes before the deflate stream in one of zlib.
ZLIB_HEADER = 2


def sniff(head: bytes) -> float:
    """How sure the first bytes are of BLF."""
    return 1.0 if head.startswith(b"LOGG") else 0.9 if head.startswith(b"LOBJ") else 0.0


def read(data: memoryview) -> Capture:
    """Frames of a BLF file."""
    parts, doubtful, damaged, other = [no_frames()], [False], [], 0
    tail, whole = b"", True
    for piece in pieces(data):
        text = tail + piece.content
        found = objects(text)
        too_long = len(text) - found.end > LONGEST_OBJECT
        if piece.broken or found.holes(whole) or too_long:
            damaged.append((piece.offset, piece.length))
        found = found.first(sound(found, parts[-1], piece.contradicted)) if piece.garbled else found
        tail, whole = b"" if piece.broken or too_long else text[found.end :], not piece.broken
        frames, passed = found.frames()
        if len(frames):
            parts.append(frames)
            doubtful.append(piece.garbled)
        other += passed
    spans = merged([s for s in damaged if s[1]])
    findings = (
        *damage_findings(spans, len(data), "damaged BLF objects"),
        *other_frames(other),
        *start_notes(data),
    )
    return Capture(joined(believed(parts, doubtful)), {}, findings, sum(n for _, n in spans), "start")


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
    """Unpacked content of one object of the file, and its place in the file.

    ``broken``: some of it is lost; ``garbled``: what is left may be wrong from an unknown place on; ``contradicted``:
    nothing is missing, but the checksum is another.
    """

    offset: int
    length: int
    content: bytes
    broken: bool = False
    garbled: bool = False
    contradicted: bool = False


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
    if method == 0:
        return Piece(start, end - start, packed, cut)
    piece = inflated(packed, start, end - start, end == len(data))
    return replace(piece, broken=True) if cut else piece


def inflated(packed: bytes, offset: int, length: int, last: bool) -> Piece:
    """What zlib can unpack; of the ``last`` container of a file the end may be cut off, and nothing is garbled."""
    engine = zlib.decompressobj()
    try:
        content = engine.decompress(packed, LARGEST_CONTAINER)
    except zlib.error:
        content, complete = salvaged(packed)
        return Piece(offset, length, content, True, True, complete)
    return Piece(offset, length, content, not engine.eof, not engine.eof and not last)


def salvaged(packed: bytes, step: int = 64) -> tuple[bytes, bool]:
    """What zlib unpacks up to where it cannot go on, without its checksum, and whether that is all."""
    engine = zlib.decompressobj(-zlib.MAX_WBITS)
    out, size = [], 0
    try:
        for i in range(ZLIB_HEADER, len(packed), step):
            if size >= LARGEST_CONTAINER or engine.eof:
                break
            out.append(engine.decompress(packed[i : i + step], LARGEST_CONTAINER - size))
            size += len(out[-1])
    except zlib.error:
        pass
    return b"".join(out), engine.eof
