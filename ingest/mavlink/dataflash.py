"""ArduPilot DataFlash logs (``.bin``): described by their own FMT records, scaled to physical values."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ingest.log import SOURCE
from ingest.reader import Decoded, Reader, ReadOptions

if TYPE_CHECKING:
    import pandas as pd

    from ingest.mavlink.dataflash_format import Format, Meanings
    from ingest.mavlink.dataflash_records import Records

#: Formats by type and length of record: a log that was appended to another may define a type anew.
Formats: TypeAlias = "dict[tuple[int, int], Format]"
#: Start of an FMT record that describes FMT itself, and of any record.
FIRST = b"\xa3\x95\x80\x80\x59FMT"
HEAD = b"\xa3\x95"


def sniff(head: bytes) -> float:
    """Near certain with an FMT record of FMT; possible with many record heads."""
    if FIRST in head[:4096]:
        return 0.99
    if b"\xa3\x95\x80" in head:
        return 0.8
    return min(0.5, head.count(HEAD) * 60 / max(len(head), 1)) if head.count(HEAD) > 3 else 0.0


def read(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
    """Decode a DataFlash log."""
    from ingest.clock import continue_clock, mended
    from ingest.damage import damage_findings, uncovered
    from ingest.detect import detect
    from ingest.mavlink.dataflash_clock import utc_of_zero
    from ingest.mavlink.dataflash_records import scan
    from ingest.mavlink.dataflash_rules import RULES, with_accuracy

    records = scan(data)
    formats = formats_in(data, records)
    if not formats:
        raise ValueError("no FMT record, so that nothing else can be decoded")
    t_ns = times(data, records, formats)
    records, t_ns = plausible(records, t_ns)
    timed = t_ns >= 0
    mended_t, stray = mended(t_ns[timed], np.zeros(int(timed.sum()), dtype=bool), records.start[timed])
    mended_t, restarts = continue_clock(mended_t)
    t_ns = carried(t_ns, timed, mended_t)
    formats = meant(data, records, formats)
    tables = with_accuracy(decode(data, records, t_ns, formats, options.topics))
    utc, utc_findings = utc_of_zero(tables)
    offset, length = uncovered(records.start, records.start + records.length, len(data))
    return Decoded(
        tables=tables,
        units=units(tables, formats),
        utc_of_index_zero_ns=utc,
        findings=(
            *damage_findings(np.column_stack([offset, length]), len(data)),
            *stray,
            *restarts,
            *utc_findings,
        ),
        messages=len(records.start),
        bytes_damaged=int(length.sum()),
        sources=detect(RULES, tables),
    )


def rows_of(data: memoryview, start: NDArray[np.int64], layout: np.dtype[np.void]) -> NDArray[np.void]:
    """Bodies of records of one type, as a structured array."""
    from ingest.mavlink.dataflash_records import HEADER

    b = np.frombuffer(data, dtype=np.uint8)
    if not len(start):
        return np.empty(0, dtype=layout)
    windows = np.lib.stride_tricks.sliding_window_view(b, layout.itemsize)
    return np.ascontiguousarray(windows[start + HEADER]).view(layout)[:, 0]


def formats_in(data: memoryview, records: Records) -> Formats:
    """Give the last sound FMT record of each type and length."""
    from ingest.mavlink.dataflash_format import FMT_DTYPE, parse_format
    from ingest.mavlink.dataflash_records import FMT, HEADER

    found = rows_of(data, records.start[records.kind == FMT], FMT_DTYPE)
    formats = [f for f in map(parse_format, found) if f is not None]
    return {(f.kind, f.dtype.itemsize + HEADER): f for f in formats if f.dtype.itemsize + HEADER < 256}


def times(data: memoryview, records: Records, formats: Formats) -> NDArray[np.int64]:
    """Nanoseconds since boot of each record; −1 where it carries no time."""
    from ingest.mavlink.dataflash_records import gather_times

    width = np.zeros(256, dtype=np.int64)
    for (kind, _), layout in formats.items():
        width[kind] = layout.time_width
    return gather_times(np.frombuffer(data, dtype=np.uint8), records.start, records.kind, width)


def plausible(records: Records, t_ns: NDArray[np.int64]) -> tuple[Records, NDArray[np.int64]]:
    """Without weak records whose time does not fit."""
    suspects = np.flatnonzero(records.weak)
    if not len(suspects):
        return records, t_ns
    keep = np.ones(len(records.start), dtype=bool)
    strong = np.flatnonzero(~records.weak & (t_ns >= 0))
    if len(strong):
        near = strong[np.clip(np.searchsorted(strong, suspects), 0, len(strong) - 1)]
        keep[suspects] = (t_ns[suspects] < 0) | (np.abs(t_ns[suspects] - t_ns[near]) < 300_000_000_000)
    return records.keep(keep), t_ns[keep]


def carried(t_ns: NDArray[np.int64], timed: NDArray[np.bool_], good: NDArray[np.int64]) -> NDArray[np.int64]:
    """Give all records a time; one that has none takes that of the record before (or the first time)."""
    if not len(good):
        return np.zeros_like(t_ns)
    out = t_ns.copy()
    out[timed] = good
    at, bare = np.flatnonzero(timed), np.flatnonzero(~timed)
    out[bare] = good[np.clip(np.searchsorted(at, bare) - 1, 0, None)]
    return out


def meant(data: memoryview, records: Records, formats: Formats) -> Formats:
    """Give the formats with units and instances."""
    from ingest.mavlink.dataflash_format import with_meaning

    meanings = meanings_in(data, records, formats)
    return {key: with_meaning(layout, meanings) for key, layout in formats.items()}


def meanings_in(data: memoryview, records: Records, formats: Formats) -> Meanings:
    """Give what UNIT, MULT and FMTU records say."""
    from ingest.mavlink.dataflash_format import Meanings, text

    def named(name: str, *columns: str) -> list[np.void]:
        found: list[np.void] = []
        for (kind, length), layout in formats.items():
            if layout.name == name and set(columns) <= set(layout.columns):
                which = (records.kind == kind) & (records.length == length)
                found += list(rows_of(data, records.start[which], layout.dtype))
        return found

    return Meanings(
        units={int(r["Id"]) & 255: text(r["Label"]) for r in named("UNIT", "Id", "Label")},
        multipliers={int(r["Id"]) & 255: float(r["Mult"]) for r in named("MULT", "Id", "Mult")},
        by_kind={
            int(r["FmtType"]): (text(r["UnitIds"]), text(r["MultIds"]))
            for r in named("FMTU", "FmtType", "UnitIds", "MultIds")
        },
    )


def decode(
    data: memoryview,
    records: Records,
    t_ns: NDArray[np.int64],
    formats: Formats,
    topics: Collection[str] | None,
) -> dict[str, pd.DataFrame]:
    """One table per name and instance: ``GPS``, and ``GPS[1]`` for the next instance."""
    tables: dict[str, pd.DataFrame] = {}
    for layout, rows in by_format(records, formats):
        if topics is not None and not wanted(layout.name, topics):
            continue
        for topic, number, which in by_instance(data, records.start, rows, layout):
            bodies = rows_of(data, records.start[which], layout.dtype)
            tables[topic] = joined(tables.get(topic), table_of(layout, bodies, t_ns[which], number))
    return tables


def by_format(records: Records, formats: Formats) -> Iterator[tuple[Format, NDArray[np.int64]]]:
    """Each format with the rows of its records."""
    from ingest.mavlink.columns import grouped

    for kind, rows in grouped(records.kind):
        lengths = records.length[rows]
        for length in np.unique(lengths) if lengths.min() < lengths.max() else lengths[:1]:
            layout = formats.get((kind, int(length)))
            if layout is not None:
                yield layout, rows if (lengths == length).all() else rows[lengths == length]


def wanted(name: str, topics: Collection[str]) -> bool:
    """Whether any topic is of this name."""
    return any(t == name or t.startswith(name + "[") for t in topics)


def joined(one: pd.DataFrame | None, other: pd.DataFrame) -> pd.DataFrame:
    """Two tables of the same topic, under one another."""
    import pandas as pd

    return other if one is None else pd.concat([one, other]).sort_index(kind="stable")


def table_of(
    layout: Format, rows: NDArray[np.void], t_ns: NDArray[np.int64], instance: int | None
) -> pd.DataFrame:
    """Give the table of one type of record, or of one instance of it."""
    from ingest.mavlink.columns import table, terminated, text_column
    from ingest.mavlink.dataflash_format import scaled

    columns: dict[str, NDArray[np.generic]] = {}
    for name, letter in zip(layout.columns, layout.letters, strict=True):
        values = rows[name]
        if values.ndim == 2:
            columns.update({f"{name}[{k}]": values[:, k] for k in range(values.shape[1])})
        elif values.dtype.kind == "S":
            columns[name] = text_column(values, terminated)
        else:
            columns[name] = scaled(values, letter)
    if instance is not None:
        columns[SOURCE] = np.full(len(rows), instance, dtype=np.int32)
    return table(t_ns, columns)


def field_place(layout: Format) -> tuple[np.dtype[Any], int]:
    """Type and offset of the field that tells instances apart."""
    if layout.instance is None or layout.dtype.fields is None:
        return np.dtype("S1"), 0
    kind, offset = layout.dtype.fields[layout.instance][:2]
    return kind, int(offset)


def by_instance(
    data: memoryview, start: NDArray[np.int64], rows: NDArray[np.int64], layout: Format
) -> list[tuple[str, int | None, NDArray[np.int64]]]:
    """Topic, number and rows of each instance.

    The lowest instance has the plain name, so that it is the same in logs with one; the others have their
    number behind it.
    """
    kind, offset = field_place(layout)
    if not len(rows) or kind.kind not in "iu":
        return [(layout.name, None, rows)]
    instance = rows_of(data, start[rows] + offset, np.dtype([("number", kind)]))["number"]
    lowest = int(instance.min())
    if lowest == int(instance.max()):
        return [(layout.name, lowest, rows)]
    numbers = [int(k) for k in np.unique(instance)]
    names = [layout.name, *(f"{layout.name}[{k}]" for k in numbers[1:])]
    return [(name, k, rows[instance == k]) for name, k in zip(names, numbers, strict=True)]


def units(tables: Collection[str], formats: Formats) -> dict[tuple[str, str], str]:
    """Units of columns, where the log states them."""
    by_name = {f.name: f for f in formats.values()}
    found = ((topic, by_name.get(topic.split("[")[0])) for topic in tables)
    return {
        (topic, column): unit
        for topic, layout in found
        if layout is not None
        for column, unit in zip(layout.columns, layout.units, strict=True)
        if unit not in ("", "UNKNOWN", "instance")
    }


DATAFLASH = Reader("dataflash", (".bin",), sniff, read)
