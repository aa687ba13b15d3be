"""How a format is declared: once, as a ``Reader`` in a tuple."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from ingest.log import Finding, Source

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class ReadOptions:
    """What a campaign may tell a reader.

    Attributes
    ----------
    dialect : mapping
        Delimited text: ``columns``, ``skip``, ``delimiter``, ``decimal``, ``encoding``;
        MAVLink: ``{"mavlink": "common"}``.
    topics : frozenset of str, optional
        Decode only these topics.
    dbc : Path, optional
        A DBC file for CAN logs.
    """

    dialect: Mapping[str, object] = field(default_factory=dict)
    topics: frozenset[str] | None = None
    dbc: Path | None = None


@dataclass(frozen=True)
class Decoded:
    """What a reader gives: columns, and what it noticed; ``ingest.read_log`` makes a ``Log`` of it.

    ``tables`` may have an index on any origin (nanoseconds, int64): ``read_log`` moves it to the first record.
    ``utc_of_index_zero_ns`` is the UTC time at index value 0, where known (0 where the index is UTC itself);
    ``of_day_of_index_zero_ns`` the time of day there, where that is all that is known of it.
    """

    tables: Mapping[str, pd.DataFrame]
    units: Mapping[tuple[str, str], str] = field(default_factory=dict)
    utc_of_index_zero_ns: int | None = None
    findings: tuple[Finding, ...] = ()
    messages: int = 0
    bytes_damaged: int = 0
    sources: tuple[Source, ...] = ()
    unsure: Mapping[str, float] = field(default_factory=dict)
    of_day_of_index_zero_ns: int | None = None
    senders: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Reader:
    """A log format.

    Attributes
    ----------
    name : str
        As it stands in ``report.json`` and in ``format =`` of a campaign.
    suffixes : tuple of str
        Break a tie between formats that are equally likely.
    sniff : callable
        ``sniff(head: bytes) -> float``: how sure (0…1) the first 64 KiB are of this format. Never raises.
    read : callable
        ``read(path, data, options) -> Decoded``; ``data`` is a bytes-like object of the whole (decompressed) file,
        memory-mapped where it can be. Raises ``ValueError`` only where there is no usable record at all.
    """

    name: str
    suffixes: tuple[str, ...]
    sniff: Callable[[bytes], float]
    read: Callable[[Path, memoryview, ReadOptions], Decoded]
