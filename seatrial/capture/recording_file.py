"""A file that is whole after every write: an MCAP in chunks that are handed to the system as they come.

What is written survives the process at once, and the machine as soon as the system has written it out, which
is asked for after every chunk. A chunk that did not fit on the disk is cut off again and tried once more.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from seatrial.capture import records
from seatrial.capture.records import ChannelSpec, ChunkPlace

LIBRARY = "seatrial"
#: zstd level: the fastest that still halves text.
LEVEL = 1


class Message(NamedTuple):
    """One message: its channel, nanoseconds on the continuous clock and by the wall clock, its payload."""

    channel: ChannelSpec
    log_ns: int
    publish_ns: int
    payload: bytes


@dataclass
class _Contents:
    """What the summary at the end tells."""

    schemas: dict[tuple[str, str, bytes], int] = field(default_factory=dict)
    channels: dict[ChannelSpec, int] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    declared: list[bytes] = field(default_factory=list)
    chunks: int = 0
    first: int = 2**63
    last: int = 0
    index: bytearray = field(default_factory=bytearray)


class RecordingFile:
    """An MCAP file that is being written.

    Parameters
    ----------
    path : Path
        A new file; one that is there is never overwritten.

    Raises
    ------
    OSError
        The file cannot be made; `append` and `finish` raise it where the disk is full.
    """

    def __init__(self, path: Path) -> None:
        import zstandard

        self.path = path
        self.size = 0
        self.messages = 0
        self._contents = _Contents()
        self._packer = zstandard.ZstdCompressor(level=LEVEL)
        self._descriptor = os.open(
            path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o644
        )
        self._write(records.MAGIC + records.header(LIBRARY))

    def append(self, messages: Iterable[Message]) -> None:
        """Write messages as one chunk; all of them are in the file, or none."""
        build = _Chunk(self._contents)
        for message in messages:
            build.add(message)
        if not build.times:
            return
        before = self.size
        plain = b"".join(build.parts)
        packed = self._packer.compress(plain)
        body = records.chunk(build.first, build.last, len(plain), zlib.crc32(plain), "zstd", packed)
        place = build.place(before, len(body), len(packed), len(plain))
        self._write(body + b"".join(build.index_records()))
        self._keep(build, place)

    def sync(self) -> None:
        """Ask the system to put what was written on the disk."""
        getattr(os, "fdatasync", os.fsync)(self._descriptor)

    def finish(self) -> None:
        """Write the index and close."""
        try:
            self._write(self._end())
            self.sync()
        finally:
            os.close(self._descriptor)

    def _keep(self, build: _Chunk, place: ChunkPlace) -> None:
        contents = self._contents
        contents.schemas, contents.channels = build.schemas, build.channels
        contents.declared += build.declared
        contents.chunks += 1
        contents.first, contents.last = min(contents.first, place.first), max(contents.last, place.last)
        contents.index += place.record()
        for number, entries in build.times.items():
            contents.counts[number] = contents.counts.get(number, 0) + len(entries)
            self.messages += len(entries)

    def _write(self, data: bytes) -> None:
        """Write all of it, or leave the file as it was."""
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._descriptor, view) :]
        except OSError:
            os.ftruncate(self._descriptor, self.size)
            os.lseek(self._descriptor, self.size, os.SEEK_SET)
            raise
        self.size += len(data)

    def _end(self) -> bytes:
        contents = self._contents
        start = self.size + len(records.data_end())
        declared = {
            op: b"".join(r for r in contents.declared if r[0] == op)
            for op in (records.SCHEMA, records.CHANNEL)
        }
        first = contents.first if contents.chunks else 0
        counted = records.statistics(
            contents.counts, len(contents.schemas), contents.chunks, first, contents.last
        )
        groups = [
            *declared.items(),
            (records.STATISTICS, counted),
            (records.CHUNK_INDEX, bytes(contents.index)),
        ]
        body, offsets = records.summary(start, groups)
        head = records.footer_head(start, offsets)
        crc = zlib.crc32(head, zlib.crc32(body)).to_bytes(4, "little")
        return records.data_end() + body + head + crc + records.MAGIC


class _Chunk:
    """A chunk while its messages come together."""

    def __init__(self, contents: _Contents) -> None:
        self.schemas, self.channels = dict(contents.schemas), dict(contents.channels)
        self.counts = contents.counts
        self.declared: list[bytes] = []
        self.parts: list[bytes] = []
        self.size = 0
        self.first, self.last = 2**63, 0
        self.times: dict[int, list[tuple[int, int]]] = {}
        self._channel: ChannelSpec | None = None
        self._number = 0
        self._entries: list[tuple[int, int]] = []

    def add(self, message: Message) -> None:
        if message.channel is not self._channel:  # a channel is hashed once per run of its messages
            self._channel = message.channel
            self._number = self.channels.get(message.channel) or self._declare(message.channel)
            self._entries = self.times.setdefault(self._number, [])
        self._entries.append((message.log_ns, self.size))
        sequence = self.counts.get(self._number, 0) + len(self._entries)
        size = len(message.payload)
        head = records.message_head(self._number, sequence, message.log_ns, message.publish_ns, size)
        self.parts += (head, message.payload)
        self.size += len(head) + size
        self.first, self.last = min(self.first, message.log_ns), max(self.last, message.log_ns)

    def _declare(self, spec: ChannelSpec) -> int:
        key = spec.schema, spec.schema_encoding, spec.definition
        schema = self.schemas.get(key, 0)
        if not schema and spec.schema_encoding:
            schema = self.schemas[key] = len(self.schemas) + 1
            self.declared.append(records.schema(schema, spec))
            self._put(self.declared[-1])
        number = self.channels[spec] = len(self.channels) + 1
        self.declared.append(records.channel(number, schema, spec))
        self._put(self.declared[-1])
        return number

    def _put(self, part: bytes) -> None:
        self.parts.append(part)
        self.size += len(part)

    def index_records(self) -> list[bytes]:
        """One index per channel."""
        return [records.message_index(number, entries) for number, entries in self.times.items()]

    def place(self, offset: int, length: int, packed: int, size: int) -> ChunkPlace:
        """The entry of this chunk in the file's index, were it written at ``offset``."""
        at, indexes = offset + length, []
        for number, body in zip(self.times, self.index_records(), strict=True):
            indexes.append((number, at))
            at += len(body)
        return ChunkPlace(
            self.first, self.last, offset, length, tuple(indexes), at - offset - length, "zstd", packed, size
        )
