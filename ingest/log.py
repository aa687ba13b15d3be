"""The first of the four data shapes: a log, as it was recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

#: Name of the column that tells several devices, systems or instances apart within one topic.
SOURCE = "source"


@dataclass(frozen=True)
class Finding:
    """Something that a reader noticed: damage, a gap, a clock that jumped.

    Attributes
    ----------
    kind : str
        ``"damaged"``, ``"truncated"``, ``"gap"``, ``"clock"``, ``"duplicate"``, ``"unknown"`` or ``"note"``.
    message : str
        One clause for a person.
    offset, length : int, optional
        Byte range in the (decompressed) file.
    topic : str, optional
        The topic that it concerns.
    count : int
        How many records it stands for.
    signal : str, optional
        The signal whose unit was guessed, as ``Source.name`` gives it: a campaign that states it knows better.
    """

    kind: str
    message: str
    offset: int | None = None
    length: int | None = None
    topic: str | None = None
    count: int = 1
    signal: str | None = None


@dataclass(frozen=True)
class Source:
    """Where a quantity can be taken from in a log.

    Attributes
    ----------
    quantity : str
        ``"position"``, ``"heading"``, ``"yaw_rate"``, ``"velocity"``, ``"wind"``, ``"depth"``, ``"rudder"`` or
        ``"propeller"``.
    topic : str
        Key into ``Log.tables``.
    fields : mapping of str to str
        Component to column, by quantity: position ``latitude``, ``longitude`` (degrees) or ``north``, ``east``
        (m); heading, yaw rate, rudder, propeller, depth ``value``; velocity ``north``, ``east`` or ``forward``,
        ``starboard``, or ``speed``, ``course``; wind ``speed``, ``direction`` (+ ``relative``: a bool column, or
        ``options["reference"]``).
    unit : str
        Unit of the values (of the angle, where there are two: see ``options``), as ``ingest.units`` knows it.
    device : int, optional
        Value of the ``source`` column to select.
    rank : float
        Better sources have a higher rank.
    options : mapping
        Facts that the conversion needs: ``{"frame": "enu"}``, ``{"magnetic": True}``, ``{"reference": "relative"}``,
        ``{"speed_unit": "kn"}``, ``{"quality": "fix_type", "quality_min": 2}``.
    """

    quantity: str
    topic: str
    fields: Mapping[str, str]
    unit: str
    device: int | None = None
    rank: float = 0.0
    options: Mapping[str, object] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The signal's name as ``seatrial inspect`` prints it."""
        device = "" if self.device is None else f" (source {self.device})"
        prefix = f"{self.topic}." if self.topic else ""
        return " + ".join(f"{prefix}{f}" for f in self.fields.values()) + device


@dataclass(frozen=True)
class Log:
    """What was recorded, as recorded.

    Attributes
    ----------
    path : Path
        The file.
    format : str
        Name of the reader: ``"tlog"``, ``"dataflash"``, ``"ulog"``, ``"nmea0183"``, ``"candump"``, ``"csv"``, …
    tables : mapping of str to DataFrame
        One table per topic. The index is ``int64`` nanoseconds on the log's main clock since the log's first
        record (named ``t_ns``, non-decreasing after the reader has dealt with jumps); columns are as decoded
        (scaled to the format's own units, see ``units``); not-available codes are NaN; a column ``source`` tells
        several devices apart. Delimited text has one topic, ``""``.
    units : mapping of (topic, field) to str
        Units where the format states them.
    utc_ns : int, optional
        Integer nanoseconds UTC of the log's first record, where the log knows UTC.
    of_day_ns : int, optional
        Time of day, UTC, of the log's first record in nanoseconds, where the log knows that and no date.
    findings : tuple of Finding
        Everything noticed while reading.
    messages, bytes_read, bytes_damaged : int
        Counts for the report.
    sources : tuple of Source
        What looks like position, heading, … best first.
    unsure : mapping of str to float
        Topics whose times follow only from the order of the records: by how many seconds all rows of one may be early
        or late together.
    senders : mapping of str to str
        Who sends the messages of a topic, where a description of them says so.
    """

    path: Path
    format: str
    tables: Mapping[str, pd.DataFrame]
    units: Mapping[tuple[str, str], str] = field(default_factory=dict)
    utc_ns: int | None = None
    of_day_ns: int | None = None
    findings: tuple[Finding, ...] = ()
    messages: int = 0
    bytes_read: int = 0
    bytes_damaged: int = 0
    sources: tuple[Source, ...] = ()
    unsure: Mapping[str, float] = field(default_factory=dict)
    senders: Mapping[str, str] = field(default_factory=dict)

    @property
    def signals(self) -> list[str]:
        """Every signal as ``TOPIC.FIELD``, or ``FIELD`` where the log has no topics."""
        return [
            f"{topic}.{column}" if topic else str(column)
            for topic, table in self.tables.items()
            for column in table.columns
            if column != SOURCE
        ]

    @property
    def duration_s(self) -> float:
        """Seconds from the first record to the last."""
        ends = [int(t.index[-1]) for t in self.tables.values() if len(t)]
        return max(ends, default=0) * 1e-9
