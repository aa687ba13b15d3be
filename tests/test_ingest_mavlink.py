"""tlog, DataFlash (binary and text), ULog: as the peers decode them, and better next to damage."""

from __future__ import annotations

import collections
import contextlib
import io
import random
import struct
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from mavlink_samples import (
    START_US,
    dataflash_body,
    dataflash_head,
    dialect,
    messages,
    record,
    tlog_records,
    ulog_body,
    ulog_head,
)  # fmt: skip
from pymavlink import DFReader, mavutil
from pyulog import ULog
from reader_checks import check_reader, log_of

from ingest import read_log
from ingest.errors import UsageError
from ingest.mavlink import READERS
from ingest.mavlink.dataflash_rules import with_accuracy
from ingest.mavlink.dialect import dialect_names, load_dialect
from ingest.mavlink.stream import LiveStream, decode_stream
from ingest.reader import ReadOptions

DATA = Path(__file__).parents[2] / "shared" / "data"
real = [pytest.mark.real, pytest.mark.skipif(not DATA.is_dir(), reason=f"needs the measured data in {DATA}")]
BY_NAME = {r.name: r for r in READERS}
TLOG, DATAFLASH, TEXT, ULOG = (BY_NAME[n] for n in ("tlog", "dataflash", "dataflash_text", "ulog"))


def equal(ours: np.ndarray, theirs: list) -> bool:
    """Field by field; a code for "not available" is NaN in ours."""
    if isinstance(theirs[0], str):
        return list(ours) == theirs
    a, b = ours.astype(float), np.asarray(theirs, dtype=float)
    missing = np.isnan(a) & np.isin(b, [127, 255, 32767, 65535, 2**31 - 1, 2**32 - 1])
    return np.array_equal(np.where(missing, b, a), b, equal_nan=True)


# --- tlog
# -----------------------------------------------------------------------------------------------------


def peer_tlog(path: Path, sender: bool = False) -> dict[str, list[dict]]:
    """Messages of pymavlink by type."""
    link = mavutil.mavlink_connection(str(path))
    out = collections.defaultdict(list)
    while (m := link.recv_match()) is not None:
        if m.get_type() != "BAD_DATA":
            out[m.get_type()].append(m.to_dict() | {"_t": m._timestamp, "_s": m.get_srcSystem()})
    link.close()
    return out


def assert_as_peer(log, peer: dict[str, list[dict]]) -> None:
    assert set(log.tables) == set(peer)
    for name, rows in peer.items():
        table = log.tables[name]
        assert len(table) == len(rows), name
        utc = (log.utc_ns + table.index.to_numpy()) * 1e-9
        assert np.allclose(utc, [r["_t"] for r in rows], rtol=0, atol=2e-6), name
        assert (table["source"] == [r["_s"] for r in rows]).all(), name
        for field, value in rows[0].items():
            if field == "mavpackettype" or field.startswith("_"):
                continue
            if isinstance(value, list):
                for k in range(len(value)):
                    assert equal(table[f"{field}[{k}]"].to_numpy(), [r[field][k] for r in rows]), (
                        name,
                        field,
                    )
            else:
                assert equal(table[field].to_numpy(), [r[field] for r in rows]), (name, field)


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


def test_dataflash_accuracies_stand_beside_the_fix():
    def at(t, **columns):
        return pd.DataFrame(columns, index=pd.Index(t, name="t_ns"))

    tables = with_accuracy({
        "GPS": at([10, 20, 30], Lat=[1.0, 2.0, 3.0]), "GPA": at([10, 30, 30], HAcc=[0.5, 0.7, 9.0], VDop=[1, 1, 1]),
        "GPS[1]": at([10], Lat=[1.0]),
    })  # fmt: skip
    np.testing.assert_array_equal(tables["GPS"]["HAcc"], [0.5, np.nan, 0.7])
    assert list(tables["GPS[1]"].columns) == ["Lat"]


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


def spots_of(records: list[bytes], count: int, seed: int = 0) -> set[int]:
    return set(random.Random(seed).sample(range(1, len(records) - 1), count))


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
    rng, live, rows, at = random.Random(0), LiveStream(), collections.Counter(), 0
    junk = rng.randbytes(3000).replace(b"\xfd", b"").replace(b"\xfe", b"")
    data = data[:1000] + junk + data[1000:]
    while at < len(data):
        size = rng.randrange(1, 200)
        for name, table in live.feed(data[at : at + size], at).items():
            rows[name] += len(table)
        at += size
    expected = log_of(TLOG, b"".join(tlog_records(40)))
    assert live.messages in (expected.messages, expected.messages - 1)
    assert rows["ATTITUDE"] >= 39
    assert live.bytes_damaged >= len(junk)


# --- DataFlash
# ------------------------------------------------------------------------------------------------


def peer_dataflash(path: Path, capfd=None) -> dict[str, list[dict]]:
    """Messages of DFReader by topic as Seatrial names them."""
    reader = DFReader.DFReader_binary(str(path))
    out, lowest = collections.defaultdict(list), {}
    while (m := reader.recv_msg()) is not None:
        row = m.to_dict() | {"_t": m._timestamp}
        name = row.pop("mavpackettype")
        if m.fmt.instance_field is not None:
            row["_i"] = row[m.fmt.instance_field]
        out[name].append(row)
    reader.close()
    split = {}
    for name, rows in out.items():
        lowest = min(r.get("_i", 0) for r in rows)
        for r in rows:
            topic = name if r.get("_i", 0) == lowest else f"{name}[{r['_i']}]"
            split.setdefault(topic, []).append(r)
    return split


def assert_as_dfreader(log, peer: dict[str, list[dict]]) -> None:
    assert set(log.tables) == set(peer)
    for topic, rows in peer.items():
        table = log.tables[topic]
        assert len(table) == len(rows), topic
        for field, value in rows[0].items():
            if field.startswith("_"):
                continue
            if hasattr(value, "tolist"):
                for k in range(len(value)):
                    assert equal(table[f"{field}[{k}]"].to_numpy(), [r[field][k] for r in rows]), (
                        topic,
                        field,
                    )
            else:
                assert equal(table[field].to_numpy(), [r[field] for r in rows]), (topic, field)


def dataflash_bytes(**options) -> bytes:
    return b"".join(dataflash_head() + dataflash_body(**options))


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


# --- DataFlash as text
# ----------------------------------------------------------------------------------------


def as_text(data: bytes, tmp_path: Path) -> bytes:
    """The way of the planners: name and values, separated by comma and blank."""
    path = tmp_path / "for_text.bin"
    path.write_bytes(data)
    reader = DFReader.DFReader_binary(str(path))
    lines = []
    while (m := reader.recv_msg()) is not None:
        values = [getattr(m, c) for c in m._fieldnames if not hasattr(getattr(m, c), "tolist")]
        if len(values) == len(m._fieldnames):
            lines.append(", ".join([m.get_type(), *map(str, values)]))
    reader.close()
    return ("\n".join(lines) + "\n").encode()


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


# --- ULog
# -----------------------------------------------------------------------------------------------------


def assert_as_pyulog(log, path: Path) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        peer = ULog(str(path))
    assert {f"{d.name}[{d.multi_id}]" if d.multi_id else d.name for d in peer.data_list} == set(log.tables)
    for d in peer.data_list:
        table = log.tables[f"{d.name}[{d.multi_id}]" if d.multi_id else d.name]
        for field, values in d.data.items():
            if "_padding" not in field:
                assert np.array_equal(table[field], values, equal_nan=values.dtype.kind == "f"), (
                    d.name,
                    field,
                )


def test_ulog_as_pyulog(tmp_path):
    path = tmp_path / "a.ulg"
    path.write_bytes(ulog_head() + b"".join(ulog_body()))
    log = read_log(path)
    assert log.format == "ulog"
    assert_as_pyulog(log, path)
    assert set(log.tables["sensor_gps[1]"]["source"]) == {1}
    assert np.allclose(log.tables["vehicle_attitude"]["heading"], np.arange(150) / 100, atol=1e-6)
    assert log.utc_ns == pytest.approx((START_US + 5_000_000) * 1000, abs=1000)
    assert {s.quantity for s in log.sources} == {"position", "heading", "yaw_rate"}
    assert any("dropout" in f.message and "40 ms" in f.message for f in log.findings)


@pytest.mark.parametrize("seed", range(3))
def test_ulog_recovers_next_to_damage(seed):
    rng = random.Random(seed)
    body = ulog_body()
    spots = spots_of(body, 20, seed)
    junk = b"".join(rng.randbytes(rng.randrange(1, 70)) + r if i in spots else r for i, r in enumerate(body))
    lost = b"".join(r[:9] + r[15:] if i in spots and i - 1 not in spots else r for i, r in enumerate(body))
    good = log_of(ULOG, ulog_head() + b"".join(body))
    for data, least in ((junk, 0), (lost, 20)):
        log = log_of(ULOG, ulog_head() + data)
        assert good.messages - least <= log.messages <= good.messages + 2
        assert log.bytes_damaged > 0


def test_ulog_text_messages_swallow_no_data():
    """Junk that looks like a long text message, followed by what looks like another."""
    body = b"".join(ulog_body())
    fake = struct.pack("<HB", 3_000, ord("I")) + b"junk"
    data = body[: len(body) // 2]
    whole = ulog_head() + body
    cut = next(k for k in range(len(data), 0, -1) if log_of(ULOG, ulog_head() + data[:k]).bytes_damaged == 0)
    end = cut + 3 + 3_000 - len(fake)
    spoilt = body[:cut] + fake + body[cut:end] + struct.pack("<HB", 20, ord("I")) + body[end:]
    good, log = log_of(ULOG, whole), log_of(ULOG, ulog_head() + spoilt)
    assert good.messages - 2 <= log.messages <= good.messages + 1


def test_ulog_twice_in_one_file(tmp_path):
    whole = ulog_head() + b"".join(ulog_body())
    one, two = log_of(ULOG, whole), log_of(ULOG, whole + whole)
    assert two.messages == 2 * one.messages
    assert two.duration_s == pytest.approx(2 * one.duration_s, rel=0.05)
    assert sum(f.kind == "clock" for f in two.findings) == 1


def test_ulog_zero_and_absurd_stamps():
    body = ulog_body()
    body[30] = body[30][:5] + bytes(8) + body[30][13:]
    body[33] = body[33][:5] + b"\xff" * 7 + b"\0" + body[33][13:]
    log = log_of(ULOG, ulog_head() + b"".join(body))
    assert log.duration_s == pytest.approx(1.49, abs=0.02)


def test_lying_lengths_allocate_nothing():
    hostile = ulog_head() + struct.pack("<HB", 65535, ord("D")) * 50
    hostile += struct.pack("<HB", 60, ord("F")) + b"inner:" + b"inner[9999999] a;".ljust(54, b" ")
    assert log_of(ULOG, hostile) is None


# --- all
# ------------------------------------------------------------------------------------------------------


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


def test_messages_are_many_kinds():
    assert len({type(m) for m in messages(0)}) == 7


# --- measured
# -------------------------------------------------------------------------------------------------


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
