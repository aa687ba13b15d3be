"""Channels that hold the bytes of a serial port as they arrived, as our own captures write them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

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


def decode_raw(
    channel: Channel,
    data: bytes,
    offsets: Integers,
    times: Integers,
    topics: frozenset[str] | None,
) -> RawStream:
    """Decode the stream of a port by the protocol that the channel's metadata name.

    Parameters
    ----------
    channel : Channel
        Its metadata may have ``protocol``: ``nmea``, ``ubx``, ``serial``, ``mavlink``, ``slcan``, ``imu``.
    data : bytes
        All pieces, joined.
    offsets, times : (n,) int64
        Where each piece begins, and when it arrived, ns.
    """
    decoder = decoder_of(channel)
    if decoder is None:
        text = f"the protocol '{protocol_of(channel)}' of this port is not decoded"
        return RawStream(findings=(Finding("unknown", text, topic=channel.topic, count=len(offsets)),))
    return decoder(channel, data, offsets, times, topics)


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


def _serial(
    channel: Channel,
    data: bytes,
    offsets: Integers,
    times: Integers,
    topics: frozenset[str] | None,
) -> RawStream:
    from ingest.marine.rules import sources_of
    from ingest.marine.stream import decode_stream

    try:
        stream = decode_stream(data, arrival=(offsets, times), topics=topics)
    except ValueError as error:
        return RawStream(findings=(Finding("unknown", str(error), topic=channel.topic, count=len(offsets)),))
    said = tuple(replace(f, topic=f.topic or channel.topic) for f in stream.findings)
    return RawStream(stream.tables, stream.units, sources_of(stream.tables), said, stream.bytes_damaged)


def _mavlink(
    channel: Channel,
    data: bytes,
    offsets: Integers,
    times: Integers,
    topics: frozenset[str] | None,
) -> RawStream:
    from ingest.detect import detect
    from ingest.mavlink.damage import damage_findings, uncovered
    from ingest.mavlink.decode import Timed, decode_frames, field_units
    from ingest.mavlink.dialect import DEFAULT, load_dialect
    from ingest.mavlink.frames import scan
    from ingest.mavlink.mavlink_rules import RULES, chosen_component

    dialect = load_dialect(channel.metadata.get("dialect", DEFAULT))
    frames = scan(data, dialect)
    start, end = frames.table["start"], frames.table["end"]
    arrived = _arrival(end, offsets, times)
    tables = decode_frames(Timed(memoryview(data), frames, arrived), dialect, topics)
    offset, length = uncovered(start, end, len(data))
    findings = tuple(
        replace(f, topic=channel.topic) for f in damage_findings(offset, length, len(data), cut=True)
    )
    sources = chosen_component(detect(RULES, tables), tables)
    return RawStream(tables, field_units(tables.keys(), dialect), sources, findings, int(length.sum()))


def _arrival(end: Integers, offsets: Integers, times: Integers) -> Integers:
    """When the piece arrived that holds the last byte before each ``end``; (n,) ns."""
    return np.asarray(times[np.clip(np.searchsorted(offsets, end - 1, side="right") - 1, 0, len(times) - 1)])


def _slcan(
    channel: Channel, data: bytes, offsets: Integers, times: Integers, topics: frozenset[str] | None
) -> RawStream:
    from ingest.canbus.damage import damage_findings
    from ingest.canbus.frames import Capture
    from ingest.canbus.reader import decoded
    from ingest.canbus.slcan import scan
    from ingest.reader import ReadOptions

    lines = scan(data)
    damage = [(int(a), int(b - a)) for a, b in lines.damage]
    hurt = tuple(
        replace(f, topic=channel.topic) for f in damage_findings(damage, len(data), "no SLCAN frame")
    )
    capture = Capture(lines.frames(_arrival(lines.end, offsets, times)), {}, hurt, 0, "utc")
    try:
        found = decoded(capture, ReadOptions(topics=topics))
    except ValueError as error:
        return RawStream(findings=(Finding("unknown", str(error), topic=channel.topic, count=len(offsets)),))
    return RawStream(
        dict(found.tables), dict(found.units), found.sources, found.findings, sum(n for _, n in damage)
    )


def _imu(
    channel: Channel, data: bytes, offsets: Integers, times: Integers, topics: frozenset[str] | None
) -> RawStream:
    from ingest.canbus.damage import damage_findings
    from ingest.marine.imu_text import read_lines, sources_of

    if b"$VN" in data:
        return _serial(channel, data, offsets, times, topics)
    text = read_lines(data)
    tables = {
        topic: table.set_axis(pd.Index(_arrival(ends, offsets, times), name="t_ns"), axis=0)
        for topic, (table, ends) in text.tables.items()
        if topics is None or topic in topics
    }
    damage = [(int(a), int(b - a)) for a, b in text.damage]
    hurt = tuple(
        replace(f, topic=channel.topic) for f in damage_findings(damage, len(data), "no line of numbers")
    )
    return RawStream(tables, {}, sources_of(tables), hurt, sum(n for _, n in damage))


Decoder = Callable[[Channel, bytes, Integers, Integers, frozenset[str] | None], RawStream]
DECODERS: Mapping[str, Decoder] = {"mavlink": _mavlink, "slcan": _slcan, "imu": _imu}
