"""The records of an MCAP file, found in bulk; an unfinished or damaged file gives all that is whole.

The layout is that of the MCAP specification: after eight magic bytes, records of an opcode (1 byte), a length (8) and
a content; chunks hold compressed records. Reading goes from front to back and needs no index, so a file that was never
finished is read up to the break; where a record cannot be right, the next chunk is searched for.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ingest.log import Finding
from ingest.ros.chunks import CHUNK, LARGEST_RECORD, is_plausible, next_chunk, unpack
from ingest.ros.message_scan import (
    CHANNEL,
    LAST_OPCODE,
    MESSAGE,
    MESSAGE_HEAD,
    PREFIX,
    SCHEMA,
    end_of_run,
    next_message,
    scan_records,
)

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]

MAGIC = b"\x89MCAP0\r\n"
FOOTER, DATA_END = 0x02, 0x0F
#: Messages are handed on when so many bytes of them have come together.
BATCH = 1 << 26


@dataclass(frozen=True)
class Channel:
    """One topic as a file declares it."""

    topic: str
    encoding: str
    schema: str = ""
    schema_encoding: str = ""
    definition: bytes = b""
    metadata: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Batch:
    """Messages of any channels.

    Attributes
    ----------
    data : (m,) uint8
        Bytes that hold them.
    channel, start, end, log_time : (n,) int64
        Number of the channel, byte range of the payload, nanoseconds.
    """

    data: Bytes
    channel: Integers
    start: Integers
    end: Integers
    log_time: Integers


@dataclass
class Contents:
    """What is known of a file while it is read."""

    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, tuple[str, str, bytes]] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    damaged: int = 0
    finished: bool = False
    last_time: int = 0

    def damage(self, kind: str, message: str, offset: int, length: int) -> None:
        """Note a damaged stretch, unless it is empty."""
        if length <= 0:
            return
        self.findings.append(Finding(kind, message, offset=offset, length=length))
        self.damaged += length


def batches(data: memoryview, contents: Contents) -> Iterator[Batch]:
    """Messages of a file in pieces of bounded size; ``contents`` is filled on the way.

    Raises
    ------
    ValueError
        Where the file does not begin as an MCAP file does.
    """
    if bytes(data[: len(MAGIC)]) != MAGIC:
        raise ValueError("does not begin with the magic bytes of MCAP")
    held: list[Batch] = []
    size = 0
    for piece in _pieces(data, contents):
        held.append(piece)
        size += len(piece.data)
        if size >= BATCH:
            yield _together(held)
            held, size = [], 0
    if held:
        yield _together(held)
    if not contents.finished:
        contents.findings.append(Finding("truncated", "the file was not finished; read up to the break"))


def _together(parts: list[Batch]) -> Batch:
    if len(parts) == 1:
        return parts[0]
    shift = np.cumsum([0, *(len(p.data) for p in parts[:-1])])
    return Batch(
        np.concatenate([p.data for p in parts]),
        np.concatenate([p.channel for p in parts]),
        np.concatenate([p.start + s for p, s in zip(parts, shift, strict=True)]),
        np.concatenate([p.end + s for p, s in zip(parts, shift, strict=True)]),
        np.concatenate([p.log_time for p in parts]),
    )


def _pieces(data: memoryview, contents: Contents) -> Iterator[Batch]:
    """Walk over the records of a file; runs of bare messages and chunks are handed on as they come."""
    p = before = len(MAGIC)
    while p + PREFIX <= len(data):
        if bytes(data[p : p + len(MAGIC)]) == MAGIC:
            contents.finished = True
            return
        opcode, end = data[p], p + PREFIX + int.from_bytes(data[p + 1 : p + PREFIX], "little")
        wrong = opcode == 0 or LAST_OPCODE < opcode < 0x80
        if wrong or end > len(data):
            onward = _next_record(data, before + 1, p, contents.last_time)
            if wrong or onward < len(data) or not _cut(data, p):
                contents.damage("damaged", f"{onward - p} bytes that are no record", p, max(0, onward - p))
                p = before = onward
                continue
        if opcode == MESSAGE and end > len(data):
            contents.damage("truncated", "the last message is cut off", p, len(data) - p)
            return
        if opcode == MESSAGE:
            stop = end_of_run(np.frombuffer(data, np.uint8), p)
            for batch in _messages(data[p:stop], contents):
                contents.last_time = int(np.median(batch.log_time[-9:]))
                before = p + int(batch.start[-1]) - MESSAGE_HEAD - PREFIX
                yield batch
            p = stop
            continue
        if opcode == CHUNK:
            yield from _chunk(data, p + PREFIX, min(end, len(data)), p, contents)
        elif end <= len(data):
            _declare(opcode, bytes(data[p + PREFIX : end]), contents)
            contents.finished |= opcode in (FOOTER, DATA_END)
        before, p = p, end


def _cut(data: memoryview, p: int) -> bool:
    """Whether a record that goes beyond the end of the file can be one that was being written."""
    length = int.from_bytes(data[p + 1 : p + PREFIX], "little")
    if length > LARGEST_RECORD:
        return False
    return data[p] != CHUNK or is_plausible(data, p)


def _next_record(data: memoryview, start: int, broken: int, last_time: int) -> int:
    """Offset of the next chunk, or of the next message outside chunks if there were any before.

    The search begins at ``start``, inside the record before the ``broken`` one: where bytes were lost, that record
    seems to reach into the next.
    """
    chunk = next_chunk(data, start)
    chunk = next_chunk(data, broken + 1) if chunk == broken else chunk
    if not last_time:
        return chunk
    message = int(next_message(np.frombuffer(data[:chunk], np.uint8), start, last_time))
    return message if message < chunk else chunk


def _declare(opcode: int, body: bytes, contents: Contents) -> None:
    """Take in a schema or channel record; one that is cut or garbled is passed over."""
    try:
        if opcode == SCHEMA:
            (number,) = struct.unpack_from("<H", body)
            name, p = _string(body, 2)
            encoding, p = _string(body, p)
            (size,) = struct.unpack_from("<I", body, p)
            contents.schemas[number] = (name, encoding, body[p + 4 : p + 4 + size])
        elif opcode == CHANNEL:
            number, schema = struct.unpack_from("<HH", body)
            topic, p = _string(body, 4)
            encoding, p = _string(body, p)
            known = contents.schemas.get(schema, ("", "", b""))
            contents.channels[number] = Channel(topic, encoding, *known, _mapping(body, p))
    except (struct.error, UnicodeDecodeError, IndexError):
        contents.findings.append(Finding("damaged", "a schema or channel record is garbled"))


def _string(body: bytes, p: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", body, p)
    return body[p + 4 : p + 4 + size].decode("utf-8"), p + 4 + size


def _mapping(body: bytes, p: int) -> dict[str, str]:
    (size,) = struct.unpack_from("<I", body, p)
    p, stop, result = p + 4, p + 4 + size, {}
    while p < min(stop, len(body)):
        key, p = _string(body, p)
        result[key], p = _string(body, p)
    return result


def _chunk(data: memoryview, body: int, end: int, offset: int, contents: Contents) -> Iterator[Batch]:
    """Return the messages of one chunk; of a broken one, those before the break."""
    if end - body < 32:
        contents.damage("truncated", "the last chunk is cut off", offset, end - offset)
        return
    _, _, size, crc, name_size = struct.unpack_from("<QQQII", data, body)
    compression = bytes(data[body + 32 : body + 32 + name_size]).decode("latin-1")
    at = body + 32 + name_size
    (length,) = struct.unpack_from("<Q", data, at) if at + 8 <= end else (0,)
    packed = data[at + 8 : min(at + 8 + length, end)]
    unpacked = unpack(packed, compression, size)
    lost = unread(unpacked, len(packed), length, size)
    if len(packed) < length:
        contents.damage("truncated", "the last chunk is cut off; read up to the break", end - lost, lost)
    elif len(unpacked) < size:
        text = f"a chunk ({compression or 'plain'}) does not unpack; read up to the break"
        contents.damage("damaged", text, end - lost, lost)
    elif crc and zlib.crc32(unpacked) != crc:
        contents.damage("damaged", "wrong checksum of a chunk; its records are kept", offset, end - offset)
    yield from _messages(unpacked, contents)


def unread(unpacked: memoryview, there: int, length: int, size: int) -> int:
    """Bytes of a chunk that are there and gave no record: exact where it is plain, else in proportion.

    Parameters
    ----------
    unpacked : (n,) bytes
    there, length, size : int
        Packed bytes that are there and that were to be, and what they unpack to.
    """
    read = end_of_run(np.frombuffer(unpacked, np.uint8), 0) if len(unpacked) else 0
    return max(0, there - round(length * read / size)) if 0 < read <= size else there


def _messages(records: memoryview, contents: Contents) -> Iterator[Batch]:
    """Messages of a run of records; schemas and channels in it are taken in."""
    if not len(records):
        return
    array = np.frombuffer(records, np.uint8)
    channel, start, end, times, others = scan_records(array)
    for p in others:
        length = int.from_bytes(records[p + 1 : p + PREFIX], "little")
        _declare(int(array[p]), bytes(records[p + PREFIX : p + PREFIX + length]), contents)
    if len(channel):
        yield Batch(array, channel, start, end, times)
