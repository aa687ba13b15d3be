"""The readers of the MAVLink family together: the common checks, recognition, memory, measured logs."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np
import pytest
from mavlink_peers import (
    BY_NAME,
    DATA,
    as_text,
    assert_as_dfreader,
    assert_as_peer,
    dataflash_bytes,
    peer_dataflash,
    peer_tlog,
    real,
)
from mavlink_samples import (
    tlog_records,
    ulog_body,
    ulog_head,
)  # fmt: skip
from pyulog import ULog
from reader_checks import check_reader

from ingest import read_log
from ingest.mavlink import READERS
from ingest.reader import ReadOptions


def samples(tmp_path: Path) -> dict[str, bytes]:
    binary = dataflash_bytes(steps=100)
    return {
        "tlog": b"".join(tlog_records(60, v1_every=4)),
        "dataflash": binary,
        "dataflash_text": as_text(binary, tmp_path),
        "ulog": ulog_head() + b"".join(ulog_body(100)),
    }


@pytest.mark.parametrize("reader", READERS, ids=lambda r: r.name)
def test_reader(reader, tmp_path):
    check_reader(reader, samples(tmp_path)[reader.name], Path("log"), rounds=2)


def test_each_format_is_recognised_by_its_content(tmp_path):
    for name, data in samples(tmp_path).items():
        path = tmp_path / "log.xyz"
        path.write_bytes(data)
        assert read_log(path).format == name


@pytest.mark.parametrize("name", ["tlog", "dataflash", "ulog"])
def test_memory_is_bounded(name, tmp_path):
    import tracemalloc

    reader, data = BY_NAME[name], samples(tmp_path)[name]
    big = data * (4_000_000 // len(data)) if name != "ulog" else data + b"".join(ulog_body(100)) * 200
    reader.read(Path("x"), memoryview(data), ReadOptions())
    tracemalloc.start()
    decoded = reader.read(Path("x"), memoryview(big), ReadOptions())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    columns = sum(int(t.memory_usage(deep=False).sum()) for t in decoded.tables.values())
    assert peak < 6 * columns


class TestMeasured:
    pytestmark = real

    def test_small_tlog(self):
        log = read_log(DATA / "formats" / "small.tlog")
        peer = peer_tlog(DATA / "formats" / "small.tlog")
        assert_as_peer(log, peer)
        assert log.messages == 35_912
        assert sum(f.kind == "damaged" for f in log.findings) == 4
        assert {"position", "heading", "yaw_rate"} <= {s.quantity for s in log.sources}

    def test_small_bin(self):
        path = DATA / "formats" / "small.BIN"
        log = read_log(path)
        assert_as_dfreader(log, peer_dataflash(path))
        assert log.utc_ns is None
        assert "position" not in {s.quantity for s in log.sources}

    def test_blueboat(self):
        for path in sorted((DATA / "blueboat").glob("*.bin")):
            log = read_log(path)
            assert_as_dfreader(log, peer_dataflash(path))
            assert log.utc_ns is None
            assert {s.quantity for s in log.sources} == {"position", "heading", "yaw_rate"}
            assert {"RCOU.C1", "RCOU.C3"} <= set(log.signals)

    def test_ulog(self):
        path = DATA / "formats" / "sample_px4_events.ulg"
        log = read_log(path)
        with contextlib.redirect_stdout(io.StringIO()):
            peer = ULog(str(path))
        for d in peer.data_list:
            table = log.tables[f"{d.name}[{d.multi_id}]" if d.multi_id else d.name]
            for field, values in d.data.items():
                if "_padding" not in field:
                    assert np.array_equal(table[field], values, equal_nan=values.dtype.kind == "f")
        assert log.utc_ns is not None
        assert log.duration_s < 40
