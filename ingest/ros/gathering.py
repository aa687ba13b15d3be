"""Batches of messages of many channels to tables, one per topic."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.detect import detect
from ingest.log import Finding
from ingest.reader import Decoded
from ingest.ros.decoding import decode
from ingest.ros.raw import PortBytes, RawStream, decode_raw, is_raw, repeats
from ingest.ros.records import Batch, Channel
from ingest.ros.rules import rules_for
from ingest.stacking import stacked

#: A log time above this is time since 1970 (1973); below, the clock of a simulation or since power-up.
UTC_FROM_NS = 100_000_000_000_000_000


@dataclass
class Gathered:
    """Pieces of tables as the batches come."""

    tables: dict[str, list[pd.DataFrame]] = field(default_factory=dict)
    raw: dict[str, list[tuple[bytes, NDArray[np.int64], NDArray[np.int64]]]] = field(default_factory=dict)
    channels: dict[str, Channel] = field(default_factory=dict)
    findings: dict[tuple[str, str], Finding] = field(default_factory=dict)
    messages: int = 0

    def note(self, found: Finding) -> None:
        """Add a finding; of the same kind and topic only one is kept, with the sum of the counts."""
        key = (found.kind, found.topic or "")
        before = self.findings.get(key)
        count = found.count + (before.count if before else 0)
        self.findings[key] = Finding(
            found.kind, found.message, found.offset, found.length, found.topic, count
        )


def gather(
    parts: Iterable[Batch], channels: Mapping[int, Channel], topics: frozenset[str] | None = None
) -> Gathered:
    """Decode batches; ``channels`` may grow while they come."""
    gathered = Gathered()
    for batch in parts:
        gathered.messages += len(batch.channel)
        order = np.argsort(batch.channel, kind="stable")
        cuts = np.flatnonzero(np.diff(batch.channel[order])) + 1
        for rows in np.split(order, cuts):
            channel = channels.get(int(batch.channel[rows[0]])) if len(rows) else None
            if channel is None or not _asked(channel, topics):
                continue
            if topics is None and repeats(channel, channels.values()):
                text = "decoded from bytes that the file holds, too: read from the bytes"
                gathered.note(Finding("note", text, topic=channel.topic, count=len(rows)))
                continue
            _take(gathered, channel, batch, rows)
    return gathered


def _asked(channel: Channel, topics: frozenset[str] | None) -> bool:
    return topics is None or channel.topic in topics or is_raw(channel)


def _take(gathered: Gathered, channel: Channel, batch: Batch, rows: NDArray[np.int64]) -> None:
    gathered.channels[channel.topic] = channel
    start, end, times = batch.start[rows], batch.end[rows], batch.log_time[rows]
    if is_raw(channel):
        pieces = b"".join(batch.data[a:b].tobytes() for a, b in zip(start, end, strict=True))
        gathered.raw.setdefault(channel.topic, []).append((pieces, end - start, times))
        return
    decoded = decode(channel, batch.data, start, end)
    if decoded is None:
        text = f"messages in the encoding '{channel.encoding}' are not decoded"
        gathered.note(Finding("unknown", text, topic=channel.topic, count=len(rows)))
        return
    for found in decoded.findings:
        gathered.note(found)
    if decoded.good.any() and len(decoded.table.columns):
        table = decoded.table.set_axis(pd.Index(times[decoded.good], name="t_ns"), axis=0)
        gathered.tables.setdefault(channel.topic, []).append(table)


def finish(
    gathered: Gathered, findings: Iterable[Finding], damaged: int, topics: frozenset[str] | None
) -> Decoded:
    """Tables, units, sources of all topics.

    Raises
    ------
    ValueError
        Where nothing could be decoded.
    """
    tables = {t: stacked(parts) for t, parts in gathered.tables.items()}
    rules = [r for t in tables for r in rules_for(gathered.channels[t].schema, t, tables[t])]
    sources = list(detect(rules, tables))
    notes = [*findings, *gathered.findings.values()]
    units: dict[tuple[str, str], str] = {}
    for stream in _streams(gathered, topics, tables):
        tables.update(stream.tables)
        units.update(stream.units)
        sources += stream.sources
        notes += stream.findings
        damaged += stream.bytes_damaged
    if not tables:
        said = "; ".join(f.message for f in notes[:3])
        raise ValueError(f"no message could be decoded{': ' + said if said else ''}")
    first = min(int(t.index[0]) for t in tables.values())
    return Decoded(
        tables=tables,
        units=units,
        utc_of_index_zero_ns=0 if first > UTC_FROM_NS else None,
        findings=tuple(notes),
        messages=gathered.messages,
        bytes_damaged=damaged,
        sources=tuple(sorted(sources, key=lambda s: -s.rank)),
    )


def _streams(
    gathered: Gathered, topics: frozenset[str] | None, taken: Mapping[str, pd.DataFrame]
) -> list[RawStream]:
    """Return what the raw channels hold; a topic that two of them have is named after its port as well."""
    streams: list[RawStream] = []
    names = set(taken)
    for topic, parts in gathered.raw.items():
        data = b"".join(p[0] for p in parts)
        sizes, times = (np.concatenate([p[i] for p in parts]) for i in (1, 2))
        port = PortBytes(gathered.channels[topic], data, np.cumsum(sizes) - sizes, times)
        stream = decode_raw(port, topics)
        clash = names & set(stream.tables)
        stream = stream.renamed({t: f"{topic}/{t}" for t in clash}) if clash else stream
        names |= set(stream.tables)
        streams.append(stream)
    return streams
