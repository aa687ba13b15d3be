"""The one check that every reader passes; each format's tests call ``check_reader`` with a good log.

    from reader_checks import check_reader
    check_reader(READER, good_bytes, Path("good.tlog"))

It holds for the whole log, for any beginning of it, and for damaged copies: nothing raises but
``ValueError`` for "no usable record"; tables are int64-indexed, in order, on the log's own clock; counts and
findings are consistent.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ingest.container import Contents
from ingest.log import SOURCE, Log
from ingest.open import as_log
from ingest.reader import Reader, ReadOptions
from ingest.units import factor_to_si

KINDS = {"damaged", "truncated", "gap", "clock", "duplicate", "unknown", "note"}
QUANTITIES = {"position", "heading", "yaw_rate", "velocity", "wind", "depth", "rudder", "propeller"}
COMPONENTS = [
    {"latitude", "longitude"}, {"north", "east"}, {"value"}, {"forward", "starboard"}, {"speed", "course"},
    {"speed", "direction"}, {"speed", "direction", "relative"},
]  # fmt: skip


def log_of(
    reader: Reader, data: bytes, path: Path = Path("log"), options: ReadOptions | None = None
) -> Log | None:
    """What ``read_log`` would give; None where the reader finds no usable record."""
    contents = Contents(memoryview(data))
    try:
        decoded = reader.read(path, contents.data, options or ReadOptions())
    except ValueError:
        return None
    return as_log(path, contents, reader, decoded)


def check_log(log: Log, size: int) -> None:
    """What holds for every log."""
    check_tables(log)
    check_counts(log, size)
    check_sources(log)


def check_tables(log: Log) -> None:
    assert log.tables, "a log without tables is unreadable"
    starts = []
    for topic, table in log.tables.items():
        index = table.index.to_numpy()
        assert index.dtype == np.int64, topic
        assert len(index), topic
        assert (np.diff(index) >= 0).all(), topic
        assert table.columns.is_unique, topic
        assert all(isinstance(c, str) for c in table.columns), topic
        starts.append(int(index[0]))
        if SOURCE in table:
            source = table[SOURCE].to_numpy(dtype=float)
            assert (np.isnan(source) | (source == np.round(source))).all(), topic
    assert min(starts) == 0
    assert log.duration_s >= 0
    assert log.utc_ns is None or isinstance(log.utc_ns, int)


def check_counts(log: Log, size: int) -> None:
    assert log.bytes_read == size
    assert 0 <= log.bytes_damaged <= size
    assert log.messages >= 1
    damaged = 0
    for finding in log.findings:
        assert finding.kind in KINDS, finding
        assert finding.message
        assert finding.count >= 1, finding
        if finding.offset is not None:
            assert 0 <= finding.offset <= size, finding
            assert finding.offset + (finding.length or 0) <= size, finding
        if finding.kind in ("damaged", "truncated"):
            assert finding.offset is not None or finding.length is None, finding
            damaged += finding.length or 0
    assert damaged <= size
    if log.bytes_damaged:
        assert any(f.kind in ("damaged", "truncated", "unknown") for f in log.findings)


def check_sources(log: Log) -> None:
    for source in log.sources:
        assert source.quantity in QUANTITIES, source
        assert source.topic in log.tables, source
        assert set(source.fields) in COMPONENTS, source
        assert set(source.fields.values()) <= set(log.tables[source.topic].columns), source
        for unit in (source.unit, str(source.options.get("speed_unit", "m/s"))):
            factor_to_si(unit)  # raises where it is not known
        if source.device is not None:
            assert (log.tables[source.topic][SOURCE] == source.device).any(), source
    for topic, column in log.units:
        assert topic in log.tables, (topic, column)


def check_sniff(reader: Reader, data: bytes, seed: int = 0) -> None:
    """A good log is recognised; nothing makes ``sniff`` raise."""
    head = data[: 1 << 16]
    assert reader.sniff(head) >= 0.5
    rng = random.Random(seed)
    heads = [
        b"",
        b"\0",
        b"\xff" * 100,
        rng.randbytes(5000),
        *(h[: 1 << 16] for _, h in damaged_copies(head, seed)),
    ]
    heads += [head[: rng.randrange(len(head))] for _ in range(10)] + [head[:k] for k in range(16)]
    for h in heads:
        assert 0.0 <= reader.sniff(h) <= 1.0


def flip(data: bytes, rng: random.Random) -> bytes:
    out = bytearray(data)
    for _ in range(max(3, len(data) // 2000)):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def insert_junk(data: bytes, rng: random.Random) -> bytes:
    at = sorted(rng.randrange(len(data)) for _ in range(4))
    parts = [
        data[a:b] + rng.randbytes(rng.randrange(1, 80))
        for a, b in zip([0, *at], [*at, len(data)], strict=True)
    ]
    return b"".join(parts)


def delete(data: bytes, rng: random.Random) -> bytes:
    out = bytearray(data)
    for _ in range(4):
        at = rng.randrange(len(out))
        del out[at : at + rng.randrange(1, 20)]
    return bytes(out)


def blank(data: bytes, rng: random.Random) -> bytes:
    at, n = rng.randrange(len(data)), rng.randrange(1, max(2, len(data) // 8))
    return data[:at] + bytes(len(data[at : at + n])) + data[at + n :]


def swap_halves(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[at:] + data[:at]


def twice(data: bytes, rng: random.Random) -> bytes:
    return data + data


def noise(data: bytes, rng: random.Random) -> bytes:
    return rng.randbytes(min(len(data), 20_000))


DAMAGE: dict[str, Callable[[bytes, random.Random], bytes]] = {
    f.__name__: f for f in (flip, insert_junk, delete, blank, swap_halves, twice, noise)
}


def damaged_copies(data: bytes, seed: int = 0) -> Iterator[tuple[str, bytes]]:
    """Copies of a log, each with one kind of damage."""
    for name, damage in DAMAGE.items():
        if data:
            yield name, damage(data, random.Random(f"{seed}-{name}"))


def check_beginnings(reader: Reader, data: bytes, path: Path, cuts: int = 25, seed: int = 0) -> None:
    """Truncation at any byte."""
    rng = random.Random(seed)
    whole = log_of(reader, data, path)
    assert whole is not None
    for cut in [0, 1, 2, 7, 64, *(rng.randrange(len(data)) for _ in range(cuts)), len(data) - 1]:
        log = log_of(reader, data[:cut], path)
        if log is not None and log.tables:
            check_log(log, min(cut, len(data)))
            assert log.messages <= whole.messages + 1


def check_damage(reader: Reader, data: bytes, path: Path, rounds: int = 3) -> None:
    """Damaged copies."""
    for seed in range(rounds):
        for _, copy in damaged_copies(data, seed):
            log = log_of(reader, copy, path)
            if log is not None and log.tables:
                check_log(log, len(copy))


def check_topics(reader: Reader, data: bytes, path: Path) -> None:
    """With ``topics``, only these are decoded, and they are the same."""
    whole = log_of(reader, data, path)
    assert whole is not None
    topic = max(whole.tables, key=lambda t: len(whole.tables[t]))
    some = log_of(reader, data, path, ReadOptions(topics=frozenset({topic})))
    assert some is not None
    assert topic in some.tables
    assert len(some.tables[topic]) == len(whole.tables[topic])
    if len(whole.tables) > 4:
        assert len(some.tables) < len(whole.tables)


def check_reader(
    reader: Reader,
    data: bytes,
    path: Path = Path("log"),
    *,
    cuts: int = 25,
    rounds: int = 3,
    sniffed: bool = True,
) -> Log:
    """All checks; returns the log of the good bytes.

    Parameters
    ----------
    reader : Reader
    data : bytes
        A good log, best some 10-200 kB.
    path : Path
        Its name (not opened).
    cuts, rounds : int
        How many truncations, and rounds of damaged copies.
    sniffed : bool
        Whether the reader is expected to recognise it.
    """
    log = log_of(reader, data, path)
    assert log is not None
    check_log(log, len(data))
    if sniffed:
        check_sniff(reader, data)
    check_beginnings(reader, data, path, cuts)
    check_damage(reader, data, path, rounds)
    check_topics(reader, data, path)
    return log
