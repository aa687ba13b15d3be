"""Our own captures: the bytes of a port, decoded by the protocol that the channel names."""

import io
import struct

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer
from mcap_ros2.writer import Writer as Ros2Writer
from ros_samples import T0, decode

from ingest.canbus.slcan import scan as scan_slcan


def test_raw_channels_of_our_own_captures():
    import pymavlink.dialects.v20.ardupilotmega as mavlink

    file = io.BytesIO()
    writer = Writer(file, chunk_size=2000)
    writer.start()
    serial = writer.register_channel("/raw/gnss", "raw", 0, metadata={"protocol": "nmea"})
    telemetry = writer.register_channel("/raw/autopilot", "raw", 0, metadata={"protocol": "mavlink"})
    link = mavlink.MAVLink(None)
    stream = b"".join(b"$GNHDT,%d.5,T*%02X\r\n" % (i, _xor(b"GNHDT,%d.5,T" % i)) for i in range(100, 150))
    for i in range(0, len(stream), 13):
        writer.add_message(serial, T0 + i * 1_000_000, stream[i : i + 13], 0)
    for i in range(30):
        packed = link.attitude_encode(i * 100, 0.0, 0.0, 0.1 * i, 0.0, 0.0, 0.01).pack(link)
        writer.add_message(telemetry, T0 + i * 10_000_000, packed, 0)
    writer.finish()
    decoded = decode(file.getvalue())
    assert decoded.tables["HDT"]["headingT"].tolist() == [i + 0.5 for i in range(100, 150)]
    assert (np.diff(decoded.tables["HDT"].index) > 0).all()
    np.testing.assert_allclose(decoded.tables["ATTITUDE"]["yaw"], 0.1 * np.arange(30), atol=1e-6)
    np.testing.assert_array_equal(np.diff(decoded.tables["ATTITUDE"].index), 10_000_000)
    assert {s.topic for s in decoded.sources if s.quantity == "heading"} == {"HDT", "ATTITUDE"}


def capture_of(protocol: str, stream: bytes, step: int = 13) -> bytes:
    """A capture of one port in pieces of ``step`` bytes, a millisecond apart."""
    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    channel = writer.register_channel("/raw/port", "raw", 0, metadata={"protocol": protocol})
    for i in range(0, len(stream), step):
        writer.add_message(channel, T0 + i // step * 1_000_000, stream[i : i + step], 0)
    writer.finish()
    return file.getvalue()


def test_a_raw_channel_of_an_slcan_adapter():
    heading = [b"T09F112248FF%04X00000000FC" % (100 * i) for i in range(1, 50)]
    fast = [b"T0DF805248%02X%s" % (0x40 + k, b"2B" + b"00" * 6 if k == 0 else b"01" * 7) for k in range(7)]
    stream = (
        b"V1013\r"
        + b"\r".join(heading[:20] + fast + [b"junk!"] + heading[20:])
        + b"\rz\rt1232AABB1F2E\rT09F1"
    )
    decoded = decode(capture_of("slcan", stream))
    table = decoded.tables["vesselHeading"]
    swapped = [((v & 255) << 8 | v >> 8) * 1e-4 for v in (100 * i for i in range(1, 50))]
    np.testing.assert_allclose(table["heading"], swapped, rtol=1e-12)
    assert (np.diff(table.index) >= 0).all() and table.index[0] > T0
    assert (decoded.tables["gnssPositionData"]["source"] == 0x24).all()
    assert {s.quantity for s in decoded.sources} >= {"heading"}
    assert [(f.length, f.topic) for f in decoded.findings if f.kind == "damaged"] == [(5, "/raw/port")]


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=40), st.integers(0, 300), st.integers(1, 400))
def test_junk_in_slcan_hides_no_whole_line(junk, at, keep):
    lines = [b"T09F11224%d%s\r" % (k % 9, b"5A" * (k % 9)) for k in range(12)]
    text = b"".join(lines)
    spoilt = text[:at] + junk.replace(b"\r", b"") + text[at:]
    found = scan_slcan(spoilt)
    whole = sum(
        at <= a or b <= at
        for a, b in zip(np.cumsum([0, *map(len, lines)]), np.cumsum([*map(len, lines)]), strict=False)
    )
    assert len(found.end) >= whole
    assert found.damage.tolist() == sorted(found.damage.tolist())
    part = scan_slcan(spoilt[:keep])
    ahead = found.end <= keep
    assert part.can_id.tolist() == found.can_id[ahead].tolist() and part.remainder <= keep


def test_a_raw_channel_of_an_inertial_sensor():
    stream = (
        b"# begins\r\n"
        + b"".join(b"#YPR=%d.50,-1.0,2.5e-1\r\n" % (10 + i) for i in range(30))
        + b"#YPR=3.0,4"
    )
    decoded = decode(capture_of("imu", stream))
    table = decoded.tables["YPR"]
    assert table["value[0]"].tolist() == [10.5 + i for i in range(30)]
    assert table["value[2]"].tolist() == [0.25] * 30
    assert [(s.quantity, s.unit, s.options["magnetic"]) for s in decoded.sources] == [
        ("heading", "deg", True)
    ]
    named = b"".join(b"yaw:%d.5 pitch: -1 roll=.25\n" % i for i in range(30))
    decoded = decode(capture_of("imu", named))
    assert decoded.tables["IMU"]["yaw"].tolist() == [i + 0.5 for i in range(30)]
    assert any(s.quantity == "heading" for s in decoded.sources)


def test_what_was_decoded_from_bytes_in_the_file_is_read_once():
    file = io.BytesIO()
    writer = Ros2Writer(file)
    schema = writer.register_msgdef("seatrial/msg/HDT", "float64 headingT")
    raw = writer._writer.register_channel("/raw/gnss", "raw", 0, metadata={"protocol": "nmea"})
    told = [
        writer._writer.register_channel(
            f"/{port}/HDT", "cdr", schema.id, metadata={"decoded_from": f"/raw/{port}"}
        )
        for port in ("gnss", "gone")
    ]
    for i in range(100, 130):
        body = b"GNHDT,%d.5,T" % i
        writer._writer.add_message(raw, T0 + i, b"$%s*%02X\r\n" % (body, _xor(body)), 0)
        for channel in told:
            writer._writer.add_message(channel, T0 + i, b"\0\1\0\0" + struct.pack("<d", i + 0.5), 0)
    writer.finish()
    decoded = decode(file.getvalue())
    assert set(decoded.tables) == {"HDT", "/gone/HDT"}
    assert [(f.topic, f.count) for f in decoded.findings if f.kind == "note"] == [("/gnss/HDT", 30)]


def _xor(body: bytes) -> int:
    value = 0
    for byte in body:
        value ^= byte
    return value
