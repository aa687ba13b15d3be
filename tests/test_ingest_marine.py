"""NMEA 0183 and its mixtures: values against the peers; damage."""

import contextlib
import io
import random

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marine_samples import clock, drive, epoch, nmea, pvt, real, same
from pynmeagps import NMEAReader

from ingest import UnreadableLog, read_log
from ingest.detect import quality_mask, stated_sigma
from ingest.marine import READERS
from ingest.marine.rules import sources_of
from ingest.marine.scan import NMEA, RTCM3, UBX, scan
from ingest.marine.stream import decode_stream

SAMPLES = [
    "GPGGA,101112.13,5959.99999,S,01025.19481833,W,2,07,1.2,-3.4,M,40.9,M,,",
    "GNRMC,101112.13,V,,,,,,,010624,,,N,V",
    "GPRMC,101112,A,6000.5,N,00030.25,E,000.5,054.7,191194,020.3,E",
    "GNGNS,101112.00,6326.4714,N,01025.1948,E,AAN,12,0.9,5.1,40.2,,,S",
    "GPGLL,6326.47,N,01025.19,W,101112.00,A,D",
    "HEHDT,123.456,T", "GPTHS,77.338,A", "HCHDG,98.3,0.0,E,12.6,W", "HCHDM,98.3,M", "TIROT,-035.6,A",
    "AGRSA,10.5,A,-3.2,A", "IIRSA,10.5,A,,V", "IIRPM,S,1,1750.2,45.0,A", "IIRPM,E,2,-1200,,A",
    "VDVBW,5.01,0.2,A,4.9,-0.3,A,0.1,A,0.2,A", "VWVHW,,T,95.2,M,5.3,N,9.8,K", "WIMWV,214.8,R,0.1,K,A",
    "WIMWD,112.0,T,108.8,M,5.8,N,3.0,M", "GPZDA,101112.00,01,06,2024,00,00", "SDDPT,2.4,0.5,",
    "SDDBT,7.8,f,2.4,M,1.3,F",
    "GPGST,101112.00,1.2,0.5,0.4,33.1,0.3,0.4,0.9", "GPVTG,054.7,T,034.4,M,005.5,N,010.2,K",
    "GNGSA,A,3,80,71,73,79,69,,,,,,,,1.83,1.09,1.47,1", "GPGSV,1,1,02,01,40,083,46,02,17,308,41",
    "PASHR,101112.000,123.47,T,-0.42,+1.31,,0.1,0.1,0.2,1,1",
    "PTNL,AVR,101112.30,+149.4688,Yaw,+0.0134,Tilt,,,60.191,3,2.5,6",
    "PUBX,00,101112.00,4717.113210,N,00833.915187,E,546.589,G3,2.1,2.0,0.007,77.52,0.007,,0.92,1.19,0.77,9,0,0",
]  # fmt: skip


#: Columns that pynmeagps gives in another form: times and dates as objects, hemispheres apart from the angle.
OTHERWISE = {"time", "utctime", "date", "NS", "EW", "deviationEW", "variationEW", "source", "msgId"}


def compare(row: pd.Series, message: object) -> None:
    for name, theirs in vars(message).items():
        if not name.startswith("_") and name not in OTHERWISE:
            assert same(row[name], theirs), f"{message.identity}.{name}: {row[name]!r} against {theirs!r}"


@pytest.mark.parametrize("body", SAMPLES)
def test_every_field_as_pynmeagps_has_it(body):
    raw = nmea(body)
    tables = decode_stream(nmea("GPZDA,101112.00,01,06,2024,00,00") + raw).tables
    peer = NMEAReader.parse(raw)
    topic = "P" + peer.msgID + body.split(",")[1] if body[:5] in {"PTNL,", "PUBX,"} else peer.msgID
    compare(tables["PASHR" if topic == "ASHR" else topic].iloc[-1], peer)


@pytest.mark.parametrize("stamped", [False, True])
def test_the_mark_of_utf_8_costs_nothing(stamped):
    lines = [f"{1717243200 + 0.05 * i:.3f} ".encode() * stamped + s for i, s in enumerate(drive(20))]
    plain, marked = decode_stream(b"".join(lines)), decode_stream(b"\xef\xbb\xbf" + b"".join(lines))
    assert not marked.findings and not marked.bytes_damaged
    assert all(table.equals(marked.tables[topic]) for topic, table in plain.tables.items())


def test_quantities():
    bodies = [*SAMPLES, "IIRPM,S,2,1700.2,45.0,A", "WIMWV,10.0,T,7.0,K,A"]
    raw = b"".join(nmea(b.replace("101112", f"10111{k}")) for k in range(3) for b in bodies) + b"".join(
        drive(3)
    )
    tables = decode_stream(raw).tables
    sources = sources_of(tables)
    assert {s.quantity for s in sources} == {
        "position", "heading", "yaw_rate", "velocity", "wind", "depth", "rudder", "propeller"
    }  # fmt: skip
    assert {s.device for s in sources if s.topic == "RPM"} == {1, 2, 102}
    assert {s.fields["value"] for s in sources if s.quantity == "rudder"} == {"stbdangle", "portangle"}
    wind = next(s for s in sources if s.topic == "MWV")
    assert wind.options["speed_unit"] == "km/h"
    assert tables["MWV"]["relative"].tolist() == [True, False] * 3


def test_errors_stand_beside_the_fix_and_modes_tell_measurements():
    raw = b"".join(
        s
        for i in range(20)
        for s in [*epoch(40_000 + i / 5), nmea(f"GNGST,{clock(40_000 + i / 5)},1,,,,0.3,0.4,0.9")]
    )
    stream = decode_stream(raw + nmea(f"GNRMC,{clock(40_010)},A,6010.0,N,01020.0,W,4.2,1.0,010624,4.7,E,E,S"))
    gga = next(s for s in sources_of(stream.tables) if s.topic == "GGA")
    sigma = stated_sigma(gga.options, stream.tables["GGA"])
    np.testing.assert_allclose(sigma, np.sqrt((0.09 + 0.16) / 2))
    rmc = next(s for s in sources_of(stream.tables) if (s.topic, s.quantity) == ("RMC", "position"))
    assert quality_mask(rmc.options, stream.tables["RMC"]).tolist() == [True] * 20 + [False]
    assert np.isnan(stated_sigma(rmc.options, stream.tables["RMC"])[-1])
    modes = ["NN", "AN", "RR", "EE", "NE"]
    raw = b"".join(nmea(f"GNGNS,{clock(i)},6010.0,N,01020.0,E,{m},9,0.9,1,1,,") for i, m in enumerate(modes))
    assert decode_stream(raw).tables["GNS"]["good"].tolist() == [0, 1, 1, 0, 0]


def test_the_noise_of_a_velocity_comes_through():
    rng = np.random.default_rng(4)
    speed = 5.0 + 0.1 * rng.standard_normal(2000)
    sentences = (
        s for i, v in enumerate(speed)
        for s in (nmea(f"GNRMC,{clock(i / 10)},A,6010.0,N,01020.0,W,,,010624,,,R,S"),
                  nmea(f"GPVTG,0.00,T,,M,{v / 1852 * 3600:.3f},N,,K,D"))
    )  # fmt: skip
    table = decode_stream(b"".join(sentences)).tables["VTG"]
    assert np.diff(table.index).tolist() == [100_000_000] * 1999
    np.testing.assert_allclose(table["sogn"] * 1852 / 3600, speed, atol=0.0003)
    assert np.std(np.diff(table["sogn"] * 1852 / 3600, 3)) / np.sqrt(20) == pytest.approx(0.1, rel=0.08)


def test_talkers_of_one_receiver_are_one_device_and_others_are_not():
    raw = b"".join(s for i in range(9) for s in epoch(i / 5, ("GN", "GP", "GL")[i % 3]))
    assert "source" not in decode_stream(raw).tables["HDT"]
    stream = decode_stream(raw + nmea("HEHDT,12.0,T") * 3)
    assert sorted(stream.tables["HDT"]["source"].unique()) == [1, 2]
    assert any("HE is source 2" in f.message for f in stream.findings)


def test_transducers_have_a_column_each():
    body = "YXXDR,A,-5.2,D,PTCH,A,12.5,D,ROLL,C,19.5,C,"
    table = decode_stream(b"".join([*drive(2), nmea(body), nmea("YXXDR,A,7.5,D,ROLL")])).tables["XDR"]
    assert table["ROLL"].tolist() == [12.5, 7.5]
    assert table["PTCH"].tolist()[0] == -5.2
    assert table["C"].tolist()[0] == 19.5


def test_a_magnetic_heading_with_its_own_variation():
    raw = b"".join([*drive(2), *(nmea(f"HCHDG,{h},1.5,E,12.0,W") for h in (5.0, 200.0))])
    stream = decode_stream(raw)
    assert stream.tables["HDG"]["headingT"].tolist() == [354.5, 189.5]
    found = [s for s in sources_of(stream.tables) if s.topic == "HDG"]
    assert [bool(s.options.get("magnetic")) for s in found] == [False, True]


def test_vectornav():
    body = "VNYMR,-123.45,+1.2,-0.3,+1.0,-0.4,+0.5,-00.1,+00.2,-09.8,+0.001,-0.002,+0.0305"
    raw = b"".join(drive(2)) + nmea(body) * 3
    stream = decode_stream(raw)
    assert stream.tables["VNYMR"]["gyroZ"].tolist() == [0.0305] * 3
    rate = next(s for s in sources_of(stream.tables) if s.quantity == "yaw_rate")
    assert (rate.topic, rate.unit) == ("VNYMR", "rad/s")


def kinds(raw: bytes) -> np.ndarray:
    return np.bincount(scan(np.frombuffer(raw, np.uint8)).kind, minlength=4)


def test_a_frame_cut_short_hides_nothing():
    lines = drive(4)
    raw = lines[0] + pvt(1.0)[:40] + b"".join(lines[1:4]) + b"$GPGGA,1235" + b"".join(lines[4:]) + pvt(2.0)
    found = kinds(raw)
    assert (found[NMEA], found[UBX], found[RTCM3]) == (len(lines), 1, 0)
    damage = [f for f in decode_stream(raw).findings if f.kind == "damaged"]
    assert [f.offset for f in damage] == [len(lines[0]), raw.index(b"$GPGGA,1235")]


def test_begins_and_ends_in_the_middle():
    raw = b"".join(drive(10))
    stream = decode_stream(raw[20:-8])
    assert [(f.kind, f.offset) for f in stream.findings] == [
        ("truncated", 0),
        ("truncated", stream.remainder),
    ]
    assert stream.messages == 38


@pytest.mark.parametrize("damage", ["flip", "junk", "cut"])
@pytest.mark.parametrize("seed", range(3))
def test_every_intact_record_is_kept(damage, seed):
    rng = random.Random(seed)
    records = [r for i in range(60) for r in (*epoch(43200 + i / 5), pvt(43200 + i / 5))]
    intact, pieces = 0, []
    for record in records:
        if rng.random() > 0.15:
            pieces.append(record)
            intact += 1
        elif damage == "flip":
            at = rng.randrange(1, len(record) - 3)
            pieces.append(record[:at] + bytes((record[at] ^ 0x15,)) + record[at + 1 :])
        elif damage == "cut":
            pieces.append(record[: rng.randrange(1, len(record) - 3)])
        else:
            pieces += [rng.randbytes(rng.randrange(1, 60)), record]
            intact += 1
    stream = decode_stream(b"".join(pieces))
    assert stream.messages == intact
    assert stream.bytes_damaged > 0


@given(st.binary(max_size=300), st.integers(0, 2000))
@settings(max_examples=100, deadline=None)
def test_junk_raises_nothing_but_value_error(junk, at):
    for reader in READERS:
        assert 0.0 <= reader.sniff(junk) <= 1.0
    raw = b"".join(drive(8))
    with contextlib.suppress(ValueError):
        decode_stream(junk)
    stream = decode_stream(raw[:at] + junk + raw[at:])
    assert 30 <= stream.messages <= 33


def test_nothing_usable(tmp_path):
    (tmp_path / "x.nmea").write_bytes(b"$GPGGA,no,good*00\r\n" * 20)
    with pytest.raises(UnreadableLog, match="nmea0183"):
        read_log(tmp_path / "x.nmea", format="nmea0183")


def test_sentences_without_checksums_where_none_has_one():
    raw = b"".join(s.split(b"*")[0] + b"\r\n" for s in drive(10))
    assert decode_stream(raw).messages == 40
    mixed = b"".join(drive(10)) + b"$GPHDT,12.0,T\r\n"
    assert decode_stream(mixed).messages == 40


@pytest.mark.real
@pytest.mark.parametrize("name", ["nmea0183_rtk_hdt.txt", "ubx_nmea_mixed.log"])
def test_real_logs_as_pynmeagps_reads_them(name):
    raw = real(name).read_bytes()[:150_000]
    tables = decode_stream(raw).tables
    row: dict[str, int] = {}
    for _, message in NMEAReader(io.BytesIO(raw)):
        if message is None:
            continue
        topic = message.msgID
        at = row.get(topic, 0)
        row[topic] = at + 1
        if at % 20 == 0:
            compare(tables[topic].iloc[at], message)
    assert row == {k: len(v) for k, v in tables.items() if k in row}


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "rate", "messages"), [("nmea0183_rtk_hdt.txt", 5, 11588), ("nmea0183_20hz.log", 20, 14111)]
)
def test_real_logs_on_their_clock(name, rate, messages):
    log = read_log(real(name))
    assert (log.format, log.messages) == ("nmea0183", messages)
    index = log.tables["GGA"].index.to_numpy()
    assert (np.diff(index) > 0).all()
    assert np.median(np.diff(index)) * 1e-9 == pytest.approx(1 / rate, rel=0.02)
    assert {s.quantity for s in log.sources} >= {"position", "heading", "velocity"}
