"""Frames to tables: transport and time apart, so that files, live ports and recorded channels share it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import SOURCE, Finding
from ingest.mavlink.columns import grouped, spread, spread_names, table, without
from ingest.mavlink.dialect import Dialect, MessageType
from ingest.mavlink.frames import Frames, gather_payloads
from ingest.mavlink.wind import with_wind


@dataclass(frozen=True)
class Timed:
    """Frames with the time of each.

    Attributes
    ----------
    data : memoryview
        The bytes that the frames point into.
    frames : Frames
    t_ns : (n,) int64
    """

    data: memoryview
    frames: Frames
    t_ns: NDArray[np.int64]


def decode_frames(
    timed: Timed, dialect: Dialect, topics: Collection[str] | None = None
) -> dict[str, pd.DataFrame]:
    """One table per type of message, with ``source`` (system id) and ``component`` beside its fields.

    Parameters
    ----------
    timed : Timed
    dialect : Dialect
    topics : collection of str, optional
        Decode only these.
    """
    tables = {}
    for kind, rows in grouped(timed.frames.kind):
        if kind < 0 or (topics is not None and dialect.types[kind].name not in topics):
            continue
        name = dialect.types[kind].name
        tables[name] = with_wind(name, decode_type(timed, dialect.types[kind], rows))
    return tables


def decode_type(timed: Timed, kind: MessageType, rows: NDArray[np.int64]) -> pd.DataFrame:
    """Give the table of one type of message."""
    frames = timed.frames.table[rows]
    raw = np.zeros((len(rows), max(kind.dtype.itemsize, 1)), dtype=np.uint8)
    b = np.frombuffer(timed.data, dtype=np.uint8)
    gather_payloads(b, frames["start"] + frames["payload"], np.ascontiguousarray(frames["length"]), raw)
    columns: dict[str, NDArray[np.generic]] = {SOURCE: frames["system"], "component": frames["component"]}
    columns |= spread(raw.view(kind.dtype)[:, 0], kind.fields)
    for field, code in kind.invalid.items():
        for name in spread_names(field, kind.dtype):
            columns[name] = without(columns[name], code)
    return table(timed.t_ns[rows], columns)


def field_units(tables: Collection[str], dialect: Dialect) -> dict[tuple[str, str], str]:
    """Units of the columns of these topics, where the dialect states them."""
    return {
        (kind.name, column): unit
        for kind in dialect.types
        if kind.name in tables
        for field, unit in kind.units.items()
        for column in spread_names(field, kind.dtype)
    }


def unknown_findings(frames: Frames, dialect: Dialect) -> list[Finding]:
    """One finding per message id that the dialect does not have."""
    numbers = frames.table["number"][frames.kind < 0]
    ids, counts = np.unique(numbers, return_counts=True)
    return [
        Finding(
            "unknown",
            f"{n} messages with id {i}, which the dialect {dialect.name} does not have",
            count=int(n),
        )
        for i, n in zip(ids, counts, strict=True)
    ]


def loss_findings(frames: Frames) -> list[Finding]:
    """How many messages each sender's sequence numbers say are missing."""
    table_ = frames.table
    sender = table_["system"].astype(np.int32) << 8 | table_["component"]
    findings = []
    for who in np.unique(sender):
        sequence = table_["sequence"][sender == who].astype(np.int64)
        lost = int(((np.diff(sequence) - 1) % 256).sum())
        share = lost / (lost + len(sequence))
        if lost and share < 0.5 and len(sequence) > 10:  # more: this sender does not number each message
            message = (
                f"{lost} messages ({share:.1%}) of system {who >> 8}, component {who & 255}, are missing"
            )
            findings.append(Finding("note", message, count=lost))
    return findings
