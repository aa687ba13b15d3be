"""tlog: as pymavlink decodes it, and better next to damage; the same frames from a live port."""

from __future__ import annotations

import collections
import random
import struct

import numpy as np
import pandas as pd
import pytest
from mavlink_peers import TLOG, assert_as_peer, peer_tlog, spots_of
from mavlink_samples import (
    START_US,
    dialect,
    messages,
    tlog_records,
)  # fmt: skip
from reader_checks import log_of

from ingest import read_log
from ingest.errors import UsageError
from ingest.mavlink.dialect import dialect_names, load_dialect
from ingest.mavlink.stream import decode_stream
from seatrial.capture.decoders import MavlinkDecoder


@pytest.mark.parametrize(("signed", "v1_every"), [(False, 0), (False, 1), (False, 3), (True, 0), (True, 4)])
def test_tlog_as_pymavlink(tmp_path, signed, v1_every):
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(tlog_records(30, signed=signed, v1_every=v1_every)))
    log = read_log(path)
    assert (log.format, log.bytes_damaged) == ("tlog", 0)
    assert_as_peer(log, peer_tlog(path))


def test_tlog_systems_are_told_apart(tmp_path):
    a, b = tlog_records(20, system=1), tlog_records(20, system=7)
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(x + y for x, y in zip(a, b, strict=True)))
    log = read_log(path)
    assert_as_peer(log, peer_tlog(path))
    assert {s.device for s in log.sources if s.quantity == "heading"} == {1, 7}
    assert not any(f.kind == "note" for f in log.findings)


def test_tlog_sources_and_units(tmp_path):
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(tlog_records(60)))
    log = read_log(path)
    best = {}
    for source in log.sources:
        best.setdefault(source.quantity, source)
    assert best["position"].name == "GPS_RAW_INT.lat + GPS_RAW_INT.lon (source 1)"
    assert best["position"].unit == "degE7"
    assert best["position"].options["accuracy"] == "h_acc"
    assert best["heading"].topic == best["yaw_rate"].topic == "ATTITUDE"
    assert (best["velocity"].topic, best["velocity"].options["speed_unit"]) == ("GPS_RAW_INT", "cm/s")
    assert best["wind"].options["reference"] == "true"
    assert not any(s.topic == "GLOBAL_POSITION_INT" and s.quantity == "heading" for s in log.sources)
    assert log.units["GPS_RAW_INT", "vel"] == "cm/s"
    assert log.units["BATTERY_STATUS", "voltages[3]"] == "mV"
    assert log.tables["GPS_RAW_INT"]["epv"].isna().all()
    assert log.utc_ns == START_US * 1000


def test_wind_as_a_velocity_of_the_air(tmp_path):
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    winds = [(-3.0, 0.0), (0.0, 2.0), (1.0, 1.0)] * 5
    frames = [
        dialect.MAVLink_wind_cov_message(i, n, e, 0, 0, 0, 0, 0.5, 0).pack(mav)
        for i, (n, e) in enumerate(winds)
    ]
    path = tmp_path / "a.tlog"
    path.write_bytes(
        b"".join(struct.pack(">Q", START_US + i * 1000) + bytes(f) for i, f in enumerate(frames))
    )
    log = read_log(path)
    (wind,) = log.sources
    table = log.tables["WIND_COV"]
    assert (wind.quantity, wind.unit, wind.options["reference"]) == ("wind", "deg", "true")
    assert table[wind.fields["direction"]].tolist()[:3] == pytest.approx([0.0, 270.0, 225.0])
    assert table[wind.fields["speed"]].tolist()[:3] == pytest.approx([3.0, 2.0, np.sqrt(2)])


def test_tlog_prefers_the_autopilot_component(tmp_path):
    gimbal = dialect.MAVLink(None, srcSystem=1, srcComponent=154)
    extra = []
    for i in range(40):
        message = dialect.MAVLink_attitude_message(i * 20, 0, 0, 1.0, 0, 0, 0)
        extra.append(struct.pack(">Q", START_US + i * 20_000) + bytes(message.pack(gimbal)))
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(tlog_records(40) + extra))
    log = read_log(path)
    heading = next(s for s in log.sources if s.quantity == "heading")
    assert heading.options["where"] == {"component": 1}
    assert set(log.tables["ATTITUDE"]["component"]) == {1, 154}


def test_tlog_topics_are_selected_early(tmp_path):
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(tlog_records(20)))
    assert set(read_log(path, topics=["ATTITUDE", "WIND"]).tables) == {"ATTITUDE", "WIND"}


def test_dialects():
    assert {"ardupilotmega", "common", "all", "minimal"} <= set(dialect_names())
    assert {t.name for t in load_dialect("minimal").types} >= {"HEARTBEAT"}
    with pytest.raises(UsageError, match="common"):
        load_dialect("comon")


def test_another_dialect(tmp_path):
    from pymavlink.dialects.v20 import ASLUAV

    mav = ASLUAV.MAVLink(None, srcSystem=3)
    own = [bytes(ASLUAV.MAVLink_asl_obctrl_message(5, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 7).pack(mav))] * 5
    data = b"".join(struct.pack(">Q", START_US + k * 1000) + f for k, f in enumerate(own))
    good = tlog_records(10)
    path = tmp_path / "a.tlog"
    path.write_bytes(b"".join(good[:20]) + data + b"".join(good[20:]))
    log = read_log(path)
    assert log.messages == len(good)
    assert log.bytes_damaged == 0
    assert [f.count for f in log.findings if f.kind == "unknown"] == [5]
    assert len(read_log(path, dialect={"mavlink": "ASLUAV"}).tables["ASL_OBCTRL"]) == 5
    with pytest.raises(UsageError, match=r"dialect\.mavlink"):
        read_log(path, dialect={"mavlink": "ardupilotmgea"})


def flip_payload(frame: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(8 + 1, len(frame) - 2)
    return frame[:at] + bytes([frame[at] ^ (1 << rng.randrange(8))]) + frame[at + 1 :]


@pytest.mark.parametrize("seed", range(3))
def test_tlog_recovers_every_intact_record(seed):
    rng = random.Random(seed)
    records = tlog_records(100, v1_every=5)
    spots = spots_of(records, 25, seed)
    flipped = b"".join(flip_payload(r, rng) if i in spots else r for i, r in enumerate(records))
    lost = b"".join(r[:12] + r[18:] if i in spots else r for i, r in enumerate(records))
    junk = b"".join(
        rng.randbytes(rng.randrange(1, 90)) + r if i in spots else r for i, r in enumerate(records)
    )
    for data, intact in ((flipped, 25), (lost, 25), (junk, 0)):
        log = log_of(TLOG, data)
        assert log.messages == len(records) - intact
        assert any(f.kind == "damaged" for f in log.findings)
        assert sum(f.length for f in log.findings if f.kind == "damaged") == log.bytes_damaged
        assert log.duration_s == pytest.approx(99 * 0.02, abs=0.05)


def test_tlog_damage_has_its_place():
    records = tlog_records(20)
    before = sum(map(len, records[:40]))
    log = log_of(TLOG, b"".join(records[:40]) + b"\xfd\xfe" * 20 + b"".join(records[40:]))
    (finding,) = [f for f in log.findings if f.kind == "damaged"]
    assert (finding.offset, finding.length, log.bytes_damaged) == (before, 40, 40)
    cut = log_of(TLOG, b"".join(records)[:-5])
    assert cut.findings[0].kind == "truncated"
    assert cut.findings[0].offset == sum(map(len, records[:-1]))


def test_tlog_broken_stamp_is_mended():
    records = tlog_records(30)
    records[50] = b"\0" + b"\xff" * 7 + records[50][8:]
    log = log_of(TLOG, b"".join(records))
    assert log.messages == len(records)
    assert log.duration_s == pytest.approx(29 * 0.02, abs=0.05)
    assert any(f.kind == "clock" for f in log.findings)


def test_tlog_clock_set_back():
    records = tlog_records(40)
    late = [struct.pack(">Q", struct.unpack(">Q", r[:8])[0] - 3_600_000_000) + r[8:] for r in records]
    log = log_of(TLOG, b"".join(records + late))
    assert log.duration_s == pytest.approx(2 * 40 * 0.02, abs=0.1)
    assert any("went back by" in f.message for f in log.findings)


def test_tlog_of_a_host_without_a_date():
    records = [struct.pack(">Q", k * 10_000) + r[8:] for k, r in enumerate(tlog_records(30))]
    assert TLOG.sniff(b"".join(records)) > 0.9
    assert log_of(TLOG, b"".join(records)).utc_ns is None


@pytest.mark.parametrize(("first", "words"), [(50_000, "started anew"), (2**32 - 200, "wrapped around")])
def test_vehicle_clock_steps_are_said(first, words):
    mav = dialect.MAVLink(None, srcSystem=4)
    out = b""
    for k in range(60):
        ms = (first + k * 20) % 2**32 if k < 30 or first > 2**31 else k * 20
        frame = dialect.MAVLink_attitude_message(ms, 0, 0, 1.0, 0, 0, 0).pack(mav)
        out += struct.pack(">Q", START_US + k * 20_000) + bytes(frame)
    (finding,) = [f for f in log_of(TLOG, out).findings if f.kind == "clock"]
    assert f"system 4 {words}" in finding.message


def test_lost_messages_are_counted():
    records = tlog_records(100)
    log = log_of(TLOG, b"".join(r for i, r in enumerate(records) if i % 10))
    (note,) = [f for f in log.findings if f.kind == "note"]
    assert note.count == len(records[1:]) - len([i for i in range(1, len(records)) if i % 10])
    assert "9.8%" in note.message


def test_stream_equals_tlog():
    records = tlog_records(50, signed=True)
    frames = [r[8:] for r in records]
    stamps = [struct.unpack(">Q", r[:8])[0] * 1000 for r in records]
    offsets = np.cumsum([0, *map(len, frames)])[:-1]
    stream = decode_stream(b"".join(frames), offsets, stamps)
    log = log_of(TLOG, b"".join(records))
    assert stream.messages == len(records)
    for name, table in log.tables.items():
        pd.testing.assert_frame_equal(
            table.reset_index(drop=True), stream.tables[name].reset_index(drop=True)
        )
        assert (table.index + log.utc_ns == stream.tables[name].index).all()
    with pytest.raises(ValueError, match="no MAVLink frame"):
        decode_stream(b"nothing", [0], [0])


def test_live_stream_in_pieces():
    data = b"".join(r[8:] for r in tlog_records(40))
    rng, live, rows, at = random.Random(0), MavlinkDecoder(), collections.Counter(), 0
    junk = rng.randbytes(3000).replace(b"\xfd", b"").replace(b"\xfe", b"")
    data, messages, damaged = data[:1000] + junk + data[1000:], 0, 0
    while at < len(data):
        size = rng.randrange(1, 200)
        found = live.feed([(at, data[at : at + size])])
        for name, table in found.tables.items():
            rows[name] += len(table)
        messages, damaged, at = messages + found.messages, damaged + found.damaged, at + size
    expected = log_of(TLOG, b"".join(tlog_records(40)))
    assert messages in (expected.messages, expected.messages - 1)
    assert rows["ATTITUDE"] >= 39
    assert damaged >= len(junk)


def test_messages_are_many_kinds():
    assert len({type(m) for m in messages(0)}) == 7
