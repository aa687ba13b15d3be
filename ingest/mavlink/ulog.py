"""PX4 ULog (``.ulg``): topics with the names and values of pyulog, and more of them next to damage."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ingest.log import SOURCE, Finding
from ingest.reader import Decoded, Reader, ReadOptions

if TYPE_CHECKING:
    import pandas as pd

    from ingest.mavlink.ulog_format import Field, Subscription

HOUR_NS = 3_600_000_000_000
MAGIC = b"ULog\x01\x12\x35"


def sniff(head: bytes) -> float:
    """Certain with its magic bytes; possible with format messages."""
    if head.startswith(MAGIC):
        return 1.0
    return 0.6 if b":uint64_t timestamp;" in head else 0.0


@dataclass
class Scan:
    """What a scan of the bytes has found so far; grows as definitions come in."""

    formats: dict[str, tuple[Field, ...]] = field(default_factory=dict)
    subscriptions: dict[int, Subscription] = field(default_factory=dict)
    records: NDArray[np.void] = field(default_factory=lambda: np.empty(0, dtype=np.dtype([])))


def read(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
    """Decode a ULog."""
    from ingest.damage import damage_findings, uncovered
    from ingest.detect import detect
    from ingest.mavlink.ulog_records import FILE_HEADER, HEADER
    from ingest.mavlink.ulog_rules import RULES

    scan = scanned(data)
    start = scan.records["start"]
    end = start + HEADER + scan.records["size"]
    rows, t_ns, clock = timed_rows(data, scan)
    if not len(rows):
        raise ValueError("no data message with a known format")
    tables = decode(data, scan, rows, t_ns, options.topics)
    offset, length = uncovered(start, end, len(data), begin=min(FILE_HEADER, len(data)))
    return Decoded(
        tables=tables,
        utc_of_index_zero_ns=utc_of_zero(tables.values()),
        findings=(
            *damage_findings(np.column_stack([offset, length]), len(data)),
            *clock,
            *dropouts(data, scan),
        ),
        messages=len(start),
        bytes_damaged=int(length.sum()),
        sources=detect(RULES, tables),
    )


def scanned(data: memoryview) -> Scan:
    """Find all messages, with the formats and subscriptions on the way."""
    from ingest.mavlink.ulog_records import BLOCK, FILE_HEADER, RECORD, limits_table, no_sizes, scan_block

    b, limits, sizes, scan = np.frombuffer(data, dtype=np.uint8), limits_table(), no_sizes(), Scan()
    p, sure, blocks, buffer = (
        FILE_HEADER if bytes(data[:7]) == MAGIC else 0,
        True,
        [],
        np.empty(BLOCK, RECORD),
    )
    while p < len(b):
        count, p, sure = scan_block(b, p, sure, limits, sizes.least, sizes.most, buffer)
        blocks.append(buffer[:count].copy())
        if count:
            learn(data, buffer[count - 1], scan)
            for identity, s in scan.subscriptions.items():
                sizes.least[identity], sizes.most[identity] = s.dtype.itemsize, s.most
    scan.records = np.concatenate(blocks) if blocks else np.empty(0, RECORD)
    return scan


def learn(data: memoryview, record: np.void, scan: Scan) -> None:
    """Take in a format or a subscription."""
    from ingest.mavlink.ulog_format import parse_format, parse_subscription
    from ingest.mavlink.ulog_records import ADD, FORMAT, HEADER

    begin = int(record["start"]) + HEADER
    body = bytes(data[begin : begin + int(record["size"])])
    if record["kind"] == FORMAT and (parsed := parse_format(body)) is not None:
        scan.formats.setdefault(*parsed)
    if record["kind"] == ADD and (subscription := parse_subscription(body, scan.formats)) is not None:
        scan.subscriptions.setdefault(subscription.identity, subscription)


def timed_rows(data: memoryview, scan: Scan) -> tuple[NDArray[np.int64], NDArray[np.int64], list[Finding]]:
    """Rows of data messages, and their times in nanoseconds since boot."""
    from ingest.clock import continue_clock, mended
    from ingest.mavlink.ulog_records import DATA

    rows = np.flatnonzero(scan.records["kind"] == DATA)
    begin = np.ascontiguousarray(scan.records["start"][rows])
    identity = scan.records["identity"][rows]
    t_ns = stamps(data, scan, begin, identity)
    stray: list[Finding] = []
    series = identity.astype(np.int64) + (1 << 16) * np.searchsorted(beginnings(data), begin)
    for one in np.unique(series):
        which = np.flatnonzero(series == one)
        t_ns[which], found = mended(t_ns[which], t_ns[which] < 0, begin[which])
        stray += found
    t_ns, restarts = continue_clock(t_ns)
    return rows, t_ns, stray + restarts


def beginnings(data: memoryview) -> NDArray[np.int64]:
    """Where logs begin: several, if they were put one after the other."""
    return np.array([m.start() for m in re.finditer(re.escape(MAGIC), data)], np.int64)


def stamps(
    data: memoryview, scan: Scan, begin: NDArray[np.int64], identity: NDArray[np.uint16]
) -> NDArray[np.int64]:
    """Give times in nanoseconds since boot; zeros and what is far from all others take the time before."""
    from ingest.mavlink.dataflash_records import gather_times

    at = np.zeros(1 << 16, dtype=np.int64)
    for number, s in scan.subscriptions.items():
        at[number] = s.dtype.fields["timestamp"][1] if s.dtype.fields else 0
    stamp = begin + 2 + at[identity]  # three bytes before it, as a DataFlash header would be
    width = np.full(256, 8, dtype=np.int64)
    b = np.frombuffer(data, dtype=np.uint8)
    t = gather_times(b, stamp, np.zeros(len(begin), dtype=np.uint8), width)
    good = t > 0
    if not good.any():
        return t
    low, high = np.quantile(t[good], (0.01, 0.99))
    good &= (t > low - HOUR_NS) & (t < high + HOUR_NS)
    kept = np.flatnonzero(good)
    before = kept[np.clip(np.searchsorted(kept, np.arange(len(t)), side="right") - 1, 0, None)]
    return np.where(good, t, t[before])


def decode(
    data: memoryview,
    scan: Scan,
    rows: NDArray[np.int64],
    t_ns: NDArray[np.int64],
    topics: Collection[str] | None,
) -> dict[str, pd.DataFrame]:
    """One table per topic and instance: ``sensor_gps``, ``sensor_gps[1]``."""
    from ingest.mavlink.ulog_rules import with_heading
    from ingest.mavlink.wind import with_wind

    identity = scan.records["identity"][rows]
    order = np.argsort(identity, kind="stable")
    ids, first = np.unique(identity[order], return_index=True)
    several = {s.name for s in scan.subscriptions.values() if s.instance > 0}
    tables: dict[str, pd.DataFrame] = {}
    for number, which in zip(ids, np.split(order, first[1:]), strict=True):
        s = scan.subscriptions[int(number)]
        topic = f"{s.name}[{s.instance}]" if s.instance else s.name
        if topics is not None and topic not in topics:
            continue
        table = table_of(data, s, scan.records["start"][rows[which]], t_ns[which], s.name in several)
        tables[topic] = with_wind(topic, with_heading(topic, joined(tables.get(topic), table)))
    return tables


def table_of(
    data: memoryview, s: Subscription, start: NDArray[np.int64], t_ns: NDArray[np.int64], numbered: bool
) -> pd.DataFrame:
    """Give the table of one subscription."""
    from ingest.mavlink.columns import table
    from ingest.mavlink.dataflash import rows_of

    bodies = rows_of(data, start + 2, s.dtype)
    names: Iterable[str] = s.dtype.names or ()
    columns = {name: bodies[name] for name in names if "_padding" not in name}
    if numbered:
        columns[SOURCE] = np.full(len(start), s.instance, dtype=np.int16)
    return table(t_ns, columns)


def joined(one: pd.DataFrame | None, other: pd.DataFrame) -> pd.DataFrame:
    """Two tables of the same topic, in order of time."""
    import pandas as pd

    return other if one is None else pd.concat([one, other]).sort_index(kind="stable")


def utc_of_zero(tables: Iterable[pd.DataFrame]) -> int | None:
    """UTC at index value 0, from a receiver that knew it; the median over its samples."""
    for table in tables:
        if "time_utc_usec" not in table.columns:
            continue
        utc = table["time_utc_usec"].to_numpy(dtype=np.int64)
        good = utc > 946_684_800_000_000
        if good.any() and len(np.unique(utc[good])) > 1:
            offset = utc[good] * 1000 - table.index.to_numpy()[good]
            return int(np.partition(offset, len(offset) // 2)[len(offset) // 2])
    return None


def dropouts(data: memoryview, scan: Scan) -> list[Finding]:
    """One finding for the times at which the logger could not keep up."""
    from ingest.mavlink.ulog_records import DROPOUT

    found = scan.records[scan.records["kind"] == DROPOUT]
    if not len(found):
        return []
    lost = found["identity"].astype(np.int64)  # its body is the duration in milliseconds
    message = (
        f"{len(found)} dropouts of the logger, {int(lost.sum())} ms in all, the longest {int(lost.max())} ms"
    )
    return [Finding("gap", message, offset=int(found["start"][0]), count=len(found))]


ULOG = Reader("ulog", (".ulg", ".ulog"), sniff, read)
