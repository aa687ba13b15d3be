"""The chunks of an MCAP file: recognised among damage, and unpacked as far as they go."""

from __future__ import annotations

import struct

import numpy as np

from ingest.ros.message_scan import PREFIX

CHUNK = 0x06
#: A chunk that claims to unpack to more than so many times its size, and more than this, is not believed.
LARGEST_CHUNK, LARGEST_RATIO = 1 << 28, 2000
#: Nor is a record that claims to be longer than this.
LARGEST_RECORD = 4 * LARGEST_CHUNK


def is_plausible(data: memoryview, p: int) -> bool:
    """Whether a chunk's head makes sense: times in order, a known compression, lengths that agree."""
    if p + PREFIX + 40 > len(data) or data[p] != CHUNK:
        return False
    length, first, last, size, _crc, name = struct.unpack_from("<QQQQII", data, p + 1)
    at = p + PREFIX + 32 + name
    if name > 8 or first > last or at + 8 > len(data):
        return False
    (records,) = struct.unpack_from("<Q", data, at)
    compression = bytes(data[at - name : at])
    agree = length == 40 + name + records and (compression or size == records)
    return bool(agree) and compression in (b"", b"lz4", b"zstd")


def next_chunk(data: memoryview, p: int) -> int:
    """Offset of the next record that looks like a chunk; the end of the file where there is none."""
    while p < len(data):
        piece = np.frombuffer(data[p : p + (1 << 22)], np.uint8)
        for at in np.flatnonzero(piece == CHUNK):
            here = p + int(at)
            length = int.from_bytes(data[here + 1 : here + PREFIX], "little")
            if length < LARGEST_RECORD and is_plausible(data, here):
                return here
        p += len(piece)
    return len(data)


def unpack(packed: memoryview, compression: str, size: int) -> memoryview:
    """Unpack as much of a chunk as there is; never more than it says, nor than can be true."""
    if not compression:
        return packed
    if size > max(LARGEST_CHUNK, LARGEST_RATIO * len(packed)):
        return memoryview(b"")
    if compression == "zstd":
        import zstandard

        try:
            return memoryview(zstandard.ZstdDecompressor().decompressobj().decompress(packed))
        except zstandard.ZstdError:
            return memoryview(b"")
    if compression == "lz4":
        import lz4.frame  # type: ignore[import-untyped]

        try:
            return memoryview(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size))
        except (RuntimeError, EOFError):
            return memoryview(b"")
    return memoryview(b"")
