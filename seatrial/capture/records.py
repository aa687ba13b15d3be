"""The records of an MCAP file as bytes, by the format's specification (version 0)."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
STATISTICS, SUMMARY_OFFSET, DATA_END = 0x0B, 0x0E, 0x0F

_MESSAGE = struct.Struct("<BQHIQQ")
_PAIR = struct.Struct("<QQ")


@dataclass(frozen=True)
class ChannelSpec:
    """A topic, how its messages are encoded, and facts about it.

    Attributes
    ----------
    topic, encoding : str
    schema, schema_encoding : str
        Name and language of the message's definition; no schema where the language is empty.
    definition : bytes
    metadata : tuple of (str, str)
    """

    topic: str
    encoding: str
    schema: str = ""
    schema_encoding: str = ""
    definition: bytes = field(default=b"", repr=False)
    metadata: tuple[tuple[str, str], ...] = ()


def record(opcode: int, body: bytes) -> bytes:
    """A record: opcode, length, content."""
    return struct.pack("<BQ", opcode, len(body)) + body


def text(value: str) -> bytes:
    """A string with its length."""
    raw = value.encode()
    return struct.pack("<I", len(raw)) + raw


def header(library: str) -> bytes:
    """The first record of a file."""
    return record(HEADER, text("") + text(library))


def schema(number: int, spec: ChannelSpec) -> bytes:
    """The definition of a channel's messages."""
    names = text(spec.schema) + text(spec.schema_encoding)
    return record(
        SCHEMA, struct.pack("<H", number) + names + struct.pack("<I", len(spec.definition)) + spec.definition
    )


def channel(number: int, schema_number: int, spec: ChannelSpec) -> bytes:
    """The declaration of a channel."""
    pairs = b"".join(text(k) + text(v) for k, v in spec.metadata)
    names = text(spec.topic) + text(spec.encoding)
    return record(
        CHANNEL, struct.pack("<HH", number, schema_number) + names + struct.pack("<I", len(pairs)) + pairs
    )


def message_head(number: int, sequence: int, log_ns: int, publish_ns: int, size: int) -> bytes:
    """All of a message but its payload of ``size`` bytes."""
    return _MESSAGE.pack(MESSAGE, 22 + size, number, sequence & 0xFFFFFFFF, log_ns, publish_ns)


def chunk(first: int, last: int, size: int, crc: int, compression: str, packed: bytes) -> bytes:
    """A chunk of records that were ``size`` bytes before they were packed."""
    head = struct.pack("<QQQI", first, last, size, crc) + text(compression) + struct.pack("<Q", len(packed))
    return record(CHUNK, head + packed)


def message_index(number: int, entries: Sequence[tuple[int, int]]) -> bytes:
    """Times of one channel's messages in a chunk, and where they begin in it."""
    body = b"".join(_PAIR.pack(time, offset) for time, offset in entries)
    return record(MESSAGE_INDEX, struct.pack("<HI", number, len(body)) + body)


@dataclass(frozen=True)
class ChunkPlace:
    """Where a chunk is, for the index."""

    first: int
    last: int
    offset: int
    length: int
    indexes: tuple[tuple[int, int], ...]
    index_length: int
    compression: str
    packed: int
    size: int

    def record(self) -> bytes:
        """The chunk's entry in the summary."""
        head = struct.pack("<QQQQ", self.first, self.last, self.offset, self.length)
        pairs = b"".join(struct.pack("<HQ", number, at) for number, at in self.indexes)
        rest = struct.pack("<Q", self.index_length) + text(self.compression)
        sizes = struct.pack("<QQ", self.packed, self.size)
        return record(CHUNK_INDEX, head + struct.pack("<I", len(pairs)) + pairs + rest + sizes)


def statistics(counts: Mapping[int, int], schemas: int, chunks: int, first: int, last: int) -> bytes:
    """How many messages there are of each channel, and from when to when."""
    pairs = b"".join(struct.pack("<HQ", number, n) for number, n in counts.items())
    body = struct.pack("<QHIIIIQQ", sum(counts.values()), schemas, len(counts), 0, 0, chunks, first, last)
    return record(STATISTICS, body + struct.pack("<I", len(pairs)) + pairs)


def data_end() -> bytes:
    """The end of the data."""
    return record(DATA_END, struct.pack("<I", 0))


def summary(start: int, groups: Iterable[tuple[int, bytes]]) -> tuple[bytes, int]:
    """The groups (opcode, records) of a summary that begins at ``start``; and where the table of groups begins."""
    body, offsets = b"", b""
    for opcode, group in groups:
        if group:
            at = start + len(body)
            offsets += record(SUMMARY_OFFSET, struct.pack("<BQQ", opcode, at, len(group)))
            body += group
    return body + offsets, start + len(body)


def footer_head(start: int, offsets: int) -> bytes:
    """The footer up to its checksum, which covers the summary and this."""
    return struct.pack("<BQQQ", FOOTER, 20, start, offsets)
