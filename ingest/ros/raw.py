"""Channels that hold the bytes of a serial port as they arrived, as our own captures write them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import Finding, Source
from ingest.ros.records import Channel

#: Encodings of channels whose messages are pieces of a byte stream.
RAW_ENCODINGS = frozenset({"raw", "x-raw", "application/octet-stream", "octet-stream"})
SERIAL = frozenset({"nmea", "nmea0183", "ubx", "serial", "rtcm", "auto", "imu", ""})


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
    offsets: NDArray[np.int64],
    times: NDArray[np.int64],
    topics: frozenset[str] | None,
) -> RawStream:
    """Decode the stream of a port by the protocol that the channel's metadata name.

    Parameters
    ----------
    channel : Channel
        Its metadata may have ``protocol``: ``nmea``, ``ubx``, ``serial``, ``mavlink``.
    data : bytes
        All pieces, joined.
    offsets, times : (n,) int64
        Where each piece begins, and when it arrived, ns.
    """
    protocol = str(channel.metadata.get("protocol", "")).lower()
    if protocol in SERIAL:
        return _serial(channel, data, offsets, times, topics)
    if protocol == "mavlink":
        return _mavlink(channel, data, offsets, times, topics)
    text = f"the protocol '{protocol}' of this port is not decoded"
    return RawStream(findings=(Finding("unknown", text, topic=channel.topic, count=len(offsets)),))


def _serial(
    channel: Channel,
    data: bytes,
    offsets: NDArray[np.int64],
    times: NDArray[np.int64],
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
    offsets: NDArray[np.int64],
    times: NDArray[np.int64],
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
    arrived = times[np.clip(np.searchsorted(offsets, end - 1, side="right") - 1, 0, len(times) - 1)]
    tables = decode_frames(Timed(memoryview(data), frames, arrived), dialect, topics)
    offset, length = uncovered(start, end, len(data))
    findings = tuple(
        replace(f, topic=channel.topic) for f in damage_findings(offset, length, len(data), cut=True)
    )
    sources = chosen_component(detect(RULES, tables), tables)
    return RawStream(tables, field_units(tables.keys(), dialect), sources, findings, int(length.sum()))
