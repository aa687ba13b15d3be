"""Channels that hold the bytes of a serial port as they arrived, as our own captures write them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.damage import damage_findings
from ingest.log import Finding, Source
from ingest.ros.records import Channel

Integers = NDArray[np.int64]
#: Encodings of channels whose messages are pieces of a byte stream.
RAW_ENCODINGS = frozenset({"raw", "x-raw", "application/octet-stream", "octet-stream"})
SERIAL = frozenset({"nmea", "nmea0183", "ubx", "serial", "rtcm", "auto", ""})
#: What a decoded channel of our own captures says in its metadata: the channel of the bytes that it came from.
DECODED_FROM = "decoded_from"


@dataclass(frozen=True)
class RawStream:
    """What the bytes of a port held."""

    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    units: dict[tuple[str, str], str] = field(default_factory=dict)
    sources: tuple[Source, ...] = ()
    findings: tuple[Finding, ...] = ()
    bytes_damaged: int = 0

    def renamed(self, names: Mapping[str, str]) -> RawStream:
        """Return the same with other names for some topics."""
        return replace(
            self,
            tables={names.get(t, t): v for t, v in self.tables.items()},
            units={(names.get(t, t), f): u for (t, f), u in self.units.items()},
            sources=tuple(replace(s, topic=names.get(s.topic, s.topic)) for s in self.sources),
        )


def is_raw(channel: Channel) -> bool:
    """Whether a channel's messages are pieces of a byte stream."""
    return channel.encoding.lower() in RAW_ENCODINGS or (
        not channel.encoding and channel.topic.startswith("/raw/")
    )


@dataclass(frozen=True)
class PortBytes:
    """The bytes of one port.

    Attributes
    ----------
    channel : Channel
        Its metadata may have ``protocol``: ``nmea``, ``ubx``, ``serial``, ``mavlink``, ``slcan``, ``imu``.
    data : bytes
        All pieces, joined.
    offsets, times : (n,) int64
        Where each piece begins, and when it arrived, ns.
    """

    channel: Channel
    data: bytes
    offsets: Integers
    times: Integers

    def arrival(self, end: Integers) -> Integers:
        """When the piece arrived that holds the last byte before each ``end``; (n,) ns."""
        piece = np.searchsorted(self.offsets, end - 1, side="right") - 1
        return np.asarray(self.times[np.clip(piece, 0, len(self.times) - 1)])

    def undecoded(self, why: str) -> RawStream:
        """Nothing but the finding that says why."""
        found = Finding("unknown", why, topic=self.channel.topic, count=len(self.offsets))
        return RawStream(findings=(found,))

    def said_here(self, findings: Iterable[Finding]) -> tuple[Finding, ...]:
        """Findings with this port's topic where they have none."""
        return tuple(replace(f, topic=f.topic or self.channel.topic) for f in findings)

    def damage(self, spans: Integers, what: str) -> tuple[tuple[Finding, ...], int]:
        """Findings for the byte ranges ``spans``, (n, 2), and how many bytes are in them."""
        damage = [(int(a), int(b - a)) for a, b in spans]
        return self.said_here(damage_findings(damage, len(self.data), what)), sum(n for _, n in damage)


def decode_raw(port: PortBytes, topics: frozenset[str] | None) -> RawStream:
    """Decode the stream of a port by the protocol that the channel's metadata name; ``topics`` alone if given."""
    decoder = decoder_of(port.channel)
    if decoder is None:
        return port.undecoded(f"the protocol '{protocol_of(port.channel)}' of this port is not decoded")
    return decoder(port, topics)


def protocol_of(channel: Channel) -> str:
    """What the metadata of a channel say its bytes are."""
    return str(channel.metadata.get("protocol", "")).lower()


def decoder_of(channel: Channel) -> Decoder | None:
    """The decoder of a channel's bytes; None where there is none for its protocol."""
    return _serial if protocol_of(channel) in SERIAL else DECODERS.get(protocol_of(channel))


def repeats(channel: Channel, channels: Iterable[Channel]) -> bool:
    """Whether a channel was decoded from the bytes of another one of the file that is decoded here again.

    The bytes hold all that the decoded channel holds and what came before its protocol was known, so they win.
    """
    origin = channel.metadata.get(DECODED_FROM)
    return origin is not None and any(
        c.topic == origin and is_raw(c) and decoder_of(c) is not None for c in channels
    )


def _serial(port: PortBytes, topics: frozenset[str] | None) -> RawStream:
    from ingest.marine.rules import sources_of
    from ingest.marine.stream import decode_stream

    try:
        stream = decode_stream(port.data, arrival=(port.offsets, port.times), topics=topics)
    except ValueError as error:
        return port.undecoded(str(error))
    said = port.said_here(stream.findings)
    return RawStream(stream.tables, stream.units, sources_of(stream.tables), said, stream.bytes_damaged)


def _mavlink(port: PortBytes, topics: frozenset[str] | None) -> RawStream:
    from ingest.mavlink.dialect import DEFAULT
    from ingest.mavlink.stream import decode_stream

    dialect = port.channel.metadata.get("dialect", DEFAULT)
    try:
        found = decode_stream(port.data, port.offsets, port.times, dialect, topics)
    except ValueError as error:
        return port.undecoded(str(error))
    said = port.said_here(found.findings)
    return RawStream(dict(found.tables), dict(found.units), found.sources, said, found.bytes_damaged)


def _slcan(port: PortBytes, topics: frozenset[str] | None) -> RawStream:
    from ingest.canbus.decoding import decoded
    from ingest.canbus.frames import Capture
    from ingest.canbus.slcan import scan
    from ingest.reader import ReadOptions

    lines = scan(port.data)
    hurt, bad = port.damage(lines.damage, "no SLCAN frame")
    capture = Capture(lines.frames(port.arrival(lines.end)), {}, hurt, 0, "utc")
    try:
        found = decoded(capture, ReadOptions(topics=topics))
    except ValueError as error:
        return port.undecoded(str(error))
    return RawStream(dict(found.tables), dict(found.units), found.sources, found.findings, bad)


def _imu(port: PortBytes, topics: frozenset[str] | None) -> RawStream:
    from ingest.marine.imu_text import read_lines, sources_of

    if b"$VN" in port.data:
        return _serial(port, topics)
    text = read_lines(port.data)
    tables = {
        topic: table.set_axis(pd.Index(port.arrival(ends), name="t_ns"), axis=0)
        for topic, (table, ends) in text.tables.items()
        if topics is None or topic in topics
    }
    hurt, bad = port.damage(text.damage, "no line of numbers")
    return RawStream(tables, {}, sources_of(tables), hurt, bad)


Decoder = Callable[[PortBytes, frozenset[str] | None], RawStream]
DECODERS: Mapping[str, Decoder] = {"mavlink": _mavlink, "slcan": _slcan, "imu": _imu}
