"""``read_log``: unpack, recognise by content, decode, put on one clock."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ingest.clock import in_order, timing_findings
from ingest.container import INNER_SUFFIXES, Contents, open_contents
from ingest.errors import FolderGiven, MissingLog, UnreadableLog, UsageError, nearest
from ingest.log import Finding, Log
from ingest.looks import HEAD as LOOKED_AT
from ingest.looks import looks_like
from ingest.reader import Decoded, Reader, ReadOptions

if TYPE_CHECKING:
    import pandas as pd

HEAD = 1 << 16
#: A folder with one file of these is a bag: the file is meant.
RECORDED = (".db3", ".mcap")
#: Readers that are less sure than this are not tried.
POSSIBLE = 0.01


#: Nanoseconds of a day.
DAY_NS = 86_400 * 10**9


def read_log(
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    dialect: Mapping[str, object] | None = None,
    topics: Iterable[str] | None = None,
    dbc: str | os.PathLike[str] | None = None,
) -> Log:
    """Read a log of any known format.

    Parameters
    ----------
    path : path-like
        Plain, or packed with gzip, xz or zstd.
    format : str, optional
        Name of a reader, where detection must be overruled.
    dialect : mapping, optional
        Delimited text: ``columns``, ``skip``, ``delimiter``, ``decimal``, ``encoding``;
        MAVLink: ``{"mavlink": "common"}``.
    topics : iterable of str, optional
        Decode only these.
    dbc : path-like, optional
        DBC file for CAN logs.

    Raises
    ------
    MissingLog
        The file is not there.
    UnreadableLog
        No reader found a usable record.
    UsageError
        ``format`` is not the name of a reader.
    """
    file = existing(Path(path))
    options = ReadOptions(
        dialect=dict(dialect or {}),
        topics=None if topics is None else frozenset(topics),
        dbc=None if dbc is None else Path(dbc),
    )
    try:
        contents = open_contents(file)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise UnreadableLog(file, [f"to open it ({reason})"], "one that cannot be read here") from error
    reader, decoded = decode(file, contents, candidates(file, contents, format), options)
    return as_log(file, contents, reader, decoded)


def existing(path: Path) -> Path:
    """Give the path itself, if it is a file; of a folder, the one log that a recorder made in it."""
    if path.is_file():
        return path
    recorded = [p for suffix in RECORDED for p in path.glob(f"*{suffix}")] if path.is_dir() else []
    if len(recorded) == 1:
        return recorded[0]
    if path.is_dir():
        raise FolderGiven(path, sorted(p.name for p in path.iterdir() if p.is_file()))
    try:
        there = [p.name for p in path.parent.iterdir() if p.is_file()]
    except OSError:
        there = []
    raise MissingLog(path, "", nearest(path.name, there))


def candidates(path: Path, contents: Contents, format: str | None) -> list[Reader]:
    """Readers to try, most likely first."""
    from ingest.readers import READERS

    if format is not None:
        return [named_reader(format, READERS)]
    head = bytes(contents.data[:HEAD])
    suffix = content_suffix(path)
    scored = [(r.sniff(head), suffix in r.suffixes, r) for r in READERS]
    possible = [s for s in scored if s[0] >= POSSIBLE]
    return [r for _, _, r in sorted(possible, key=lambda s: s[:2], reverse=True)]


def named_reader(name: str, readers: Iterable[Reader]) -> Reader:
    """Give the reader with a name."""
    by_name = {r.name: r for r in readers}
    if name in by_name:
        return by_name[name]
    near = nearest(name, by_name) or sorted(by_name)
    raise UsageError(
        f"format: expected the name of a log format, found '{name}'. Nearest: {', '.join(near)}."
    )


def content_suffix(path: Path) -> str:
    """Suffix in lower case, under that of a compression."""
    inner = path.with_suffix("") if path.suffix.lower() in INNER_SUFFIXES else path
    return inner.suffix.lower()


@dataclass(frozen=True)
class Attempt:
    """A reader that found nothing, and why."""

    reader: str
    reason: str


def decode(
    path: Path, contents: Contents, readers: list[Reader], options: ReadOptions
) -> tuple[Reader, Decoded]:
    """Give what the first reader that finds a usable record gives."""
    attempts = []
    for reader in readers:
        try:
            decoded = reader.read(path, contents.data, options)
        except ValueError as error:
            attempts.append(Attempt(reader.name, str(error)))
            continue
        if any(len(table) for table in decoded.tables.values()) or options.topics is not None:
            return reader, decoded
        attempts.append(Attempt(reader.name, "no records"))
    raise UnreadableLog(
        path, tried(attempts), looks_like(bytes(contents.data[:LOOKED_AT]), len(contents.data))
    )


def tried(attempts: list[Attempt]) -> list[str]:
    """Give what was tried, with reasons, for the message."""
    if attempts:
        return [f"{a.reader} ({a.reason})" for a in attempts]
    from ingest.readers import READERS

    return [r.name for r in READERS]


def as_log(path: Path, contents: Contents, reader: Reader, decoded: Decoded) -> Log:
    """Give the log, on its own clock from its first record."""
    tables, findings = ordered(decoded.tables)
    origin = min((int(t.index[0]) for t in tables.values()), default=0)
    tables = {topic: moved(table, origin) for topic, table in tables.items()}
    utc, of_day = decoded.utc_of_index_zero_ns, decoded.of_day_of_index_zero_ns
    return Log(
        path=path,
        format=reader.name,
        tables=tables,
        units={name: unit for name, unit in decoded.units.items() if name[0] in tables},
        utc_ns=None if utc is None else int(utc) + origin,
        of_day_ns=None if of_day is None else (int(of_day) + origin) % DAY_NS,
        findings=(
            *contents.findings,
            *contents.placed(decoded.findings),
            *findings,
            *timing_findings(tables),
        ),
        messages=decoded.messages,
        bytes_read=contents.before + len(contents.data),
        bytes_damaged=decoded.bytes_damaged,
        sources=tuple(s for s in decoded.sources if s.topic in tables),
        unsure=decoded.unsure,
        senders=decoded.senders,
    )


def ordered(tables: Mapping[str, pd.DataFrame]) -> tuple[dict[str, pd.DataFrame], list[Finding]]:
    """Tables that have records, each in order of time, and what was out of order."""
    out: dict[str, pd.DataFrame] = {}
    findings: list[Finding] = []
    for topic, table in tables.items():
        if len(table):
            out[topic], found = in_order(topic, table)
            findings += found
    return out, findings


def moved(table: pd.DataFrame, origin: int) -> pd.DataFrame:
    """Give the table with its index moved to ``origin`` and named."""
    import pandas as pd

    index = pd.Index(table.index.to_numpy(dtype="int64") - origin, name="t_ns")
    return table.set_axis(index, axis=0)
