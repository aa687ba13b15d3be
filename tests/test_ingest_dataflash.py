"""DataFlash, binary and text: as DFReader decodes it, and better next to damage."""

from __future__ import annotations

import random
import struct

import numpy as np
import pandas as pd
import pytest
from mavlink_peers import (
    DATAFLASH,
    TEXT,
    as_text,
    assert_as_dfreader,
    dataflash_bytes,
    peer_dataflash,
    spots_of,
)
from mavlink_samples import (
    dataflash_body,
    dataflash_head,
    record,
)  # fmt: skip
from reader_checks import log_of

from ingest import read_log
from ingest.mavlink.dataflash_rules import with_accuracy


def test_dataflash_accuracies_stand_beside_the_fix():
    def at(t, **columns):
        return pd.DataFrame(columns, index=pd.Index(t, name="t_ns"))

    tables = with_accuracy({
        "GPS": at([10, 20, 30], Lat=[1.0, 2.0, 3.0]), "GPA": at([10, 30, 30], HAcc=[0.5, 0.7, 9.0], VDop=[1, 1, 1]),
        "GPS[1]": at([10], Lat=[1.0]),
    })  # fmt: skip
    np.testing.assert_array_equal(tables["GPS"]["HAcc"], [0.5, np.nan, 0.7])
    assert list(tables["GPS[1]"].columns) == ["Lat"]


def test_dataflash_as_dfreader(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(dataflash_bytes())
    log, peer = read_log(path), peer_dataflash(path)
    assert log.format == "dataflash"
    assert_as_dfreader(log, peer)
    table = log.tables["ATT"]
    assert np.allclose((log.utc_ns + table.index) * 1e-9, [r["_t"] for r in peer["ATT"]], rtol=0, atol=1e-5)


def test_dataflash_instances_units_sources(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(dataflash_bytes())
    log = read_log(path)
    assert {"IMU", "IMU[1]"} <= set(log.tables)
    assert set(log.tables["IMU[1]"]["source"]) == {1}
    assert "IMU[1].GyrZ" in log.signals
    assert log.units["IMU", "GyrZ"] == "mrad/s"
    assert log.units["GPS", "Lat"] == "deglatitude"
    best = {}
    for source in log.sources:
        best.setdefault(source.quantity, source)
    assert best["position"].topic == "GPS"
    assert best["velocity"].options["speed_unit"] == "m/s"
    assert best["heading"].topic == "ATT"
    assert best["yaw_rate"].topic == "IMU"
    assert log.tables["MSG"]["Message"].iloc[0] == "event, number 0"


@pytest.mark.parametrize(("week", "leap"), [(1350, 13), (1600, 15), (1800, 16), (1900, 17), (2290, 18)])
def test_dataflash_leap_seconds_of_the_date(week, leap):
    log = log_of(DATAFLASH, dataflash_bytes(week=week, first_ms=1_000))
    first = 315_964_800 + week * 604_800 + 1.0 - leap
    assert log.utc_ns * 1e-9 == pytest.approx(first, abs=0.05)


def test_dataflash_over_the_end_of_a_week():
    body = b"".join(
        record(
            "GPS",
            60_000_000 + i * 200_000,
            0,
            3,
            ms % 604_800_000,
            2290 + ms // 604_800_000,
            14,
            80,
            i,
            i,
            1.0,
            2.0,
        )
        for i in range(40)
        for ms in (604_796_000 + i * 200,)
    )
    log = log_of(DATAFLASH, b"".join(dataflash_head()) + body)
    table = log.tables["GPS"]
    first = (315_964_800 + 2291 * 604_800 - 4 - 18) * 1_000_000_000
    assert log.utc_ns + table.index[0] == first
    assert not [f for f in log.findings if f.kind == "clock"]


@pytest.mark.parametrize(("week", "first_ms"), [(0, 345_600_120), (2300, 0)])
def test_dataflash_placeholder_time(week, first_ms):
    log = log_of(DATAFLASH, dataflash_bytes(week=week, first_ms=first_ms))
    assert log.utc_ns is None
    assert any("placeholders" in f.message for f in log.findings)


def test_dataflash_placeholder_velocity():
    body = [
        record("GPS", 10**6 + i * 200_000, 0, 3, 5 + i * 200, 2290, 9, 80, 634_000_000 + i, 10**8, 0, 0)
        for i in range(30)
    ]
    log = log_of(DATAFLASH, b"".join(dataflash_head() + body))
    assert {s.quantity for s in log.sources} == {"position"}


@pytest.mark.parametrize("seed", range(3))
def test_dataflash_recovers_next_to_damage(tmp_path, seed):
    rng = random.Random(seed)
    head, body = dataflash_head(), dataflash_body()
    spots = spots_of(body, 25, seed)
    junk = b"".join(rng.randbytes(rng.randrange(1, 70)) + r if i in spots else r for i, r in enumerate(body))
    lost = b"".join(r[:9] + r[15:] if i in spots and i - 1 not in spots else r for i, r in enumerate(body))
    dropped = sum(i - 1 not in spots for i in spots)
    for data, least in ((junk, len(body)), (lost, len(body) - dropped)):
        path = tmp_path / "a.bin"
        path.write_bytes(b"".join(head) + data)
        log = read_log(path)
        peer = sum(map(len, peer_dataflash(path).values()))
        assert len(head) + least <= log.messages <= len(head) + len(body)
        assert log.messages >= min(peer, len(head) + least)
        assert log.duration_s == pytest.approx(63.0, abs=0.2) or log.duration_s == pytest.approx(
            62.98, abs=0.2
        )


def test_dataflash_type_defined_anew():
    head, body = dataflash_head(), dataflash_body(steps=60)
    again = record("FMT", 131, 3 + 8 + 4, b"ATT", b"Qf", b"TimeUS,Yaw")
    more = [b"\xa3\x95\x83" + struct.pack("<Qf", 62_000_000 + i * 20_000, 9.0) for i in range(40)]
    log = log_of(DATAFLASH, b"".join([*head, *body, again, *more]))
    assert log.bytes_damaged == 0
    yaw = log.tables["ATT"]["Yaw"]
    assert len(yaw) == 100
    assert (yaw.iloc[60:] == 9.0).all()


def test_dataflash_fmt_with_a_lying_length():
    head = dataflash_head()
    head[2] = head[2][:4] + b"\xff" + head[2][5:]
    log = log_of(DATAFLASH, b"".join(head + dataflash_body()))
    assert len(log.tables["ATT"]) == 150


def test_text_equals_binary(tmp_path):
    data = dataflash_bytes()
    binary, text = log_of(DATAFLASH, data), log_of(TEXT, as_text(data, tmp_path))
    assert TEXT.sniff(as_text(data, tmp_path)[:5000]) > 0.9
    assert set(binary.tables) == set(text.tables) | {"ARR"}
    assert text.utc_ns == pytest.approx(binary.utc_ns, abs=1000)
    for topic, table in text.tables.items():
        other = binary.tables[topic]
        assert list(table.columns) == list(other.columns)
        assert (table.index == other.index).all()
        for column in table.columns:
            if other[column].dtype.kind in "iuf":
                assert np.allclose(table[column].astype(float), other[column].astype(float), rtol=1e-6), (
                    column
                )
            else:
                assert list(table[column]) == list(other[column])


def test_text_bad_lines_are_counted(tmp_path):
    lines = as_text(dataflash_bytes(), tmp_path).split(b"\n")
    place = next(i for i, line in enumerate(lines) if line.startswith(b"ATT")) + 40
    glued = lines[place] + lines[place + 1]
    text = b"\n".join([*lines[:place], glued, b"ATT, 12", b"\xff\xfe\x00", *lines[place + 2 :]])
    log, whole = log_of(TEXT, text), log_of(TEXT, b"\n".join(lines))
    assert log.messages == whole.messages - 2
    damaged = [f for f in log.findings if f.kind == "damaged"]
    assert [f.length for f in damaged] == [len(glued), 7, 3]
    assert text[damaged[1].offset :].startswith(b"ATT, 12\n")
