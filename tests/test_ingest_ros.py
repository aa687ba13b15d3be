"""MCAP files and ROS 2 bags: values against the peers, unfinished and damaged files, our own captures."""

import io
import json
import random
import sqlite3
import struct
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from ingest import ReadOptions, UnreadableLog, read_log
from ingest.canbus.slcan import scan as scan_slcan
from ingest.reader import Decoded
from ingest.ros import READERS
from ingest.ros.json_columns import columns_of as json_columns
from ingest.ros.readers import MCAP

T0 = 1_717_200_000_000_000_000
STORE = get_typestore(Stores.ROS2_HUMBLE)
ODD = """std_msgs/Header header
int8 small
uint64 large
bool flag
float32 single
string[] names
float64[] values
geometry_msgs/Point[] corners
uint8[] image
string tail
"""


def text_of(kind: str) -> str:
    return STORE.generate_msgdef(kind, ros_version=2)[0]


def stamp(i: int) -> dict[str, object]:
    return {
        "stamp": {"sec": 1_717_200_000 + i // 10, "nanosec": i % 10 * 100_000_000},
        "frame_id": "gps" * (1 + i % 3),
    }


def messages(i: int) -> dict[str, tuple[str, dict[str, object]]]:
    yaw = 0.01 * i
    quaternion = {"x": 0.0, "y": 0.0, "z": np.sin(yaw / 2), "w": np.cos(yaw / 2)}
    twist = {"linear": {"x": 1.0 + i, "y": -0.1, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.02}}
    pose = {"position": {"x": 2.0 * i, "y": 3.0, "z": 0.0}, "orientation": quaternion}
    return {
        "/gps/fix": ("sensor_msgs/msg/NavSatFix", {
            "header": stamp(i), "status": {"status": 2, "service": 1}, "latitude": 60.0 + i * 1e-6,
            "longitude": -10.0 - i * 1e-6, "altitude": 3.5,
            "position_covariance": [0.1 * k for k in range(9)]}),
        "/imu": ("sensor_msgs/msg/Imu", {
            "header": stamp(i), "orientation": quaternion, "angular_velocity": {"x": 0.0, "y": 0.0,
                "z": 0.01 * i}}),
        "/odom": ("nav_msgs/msg/Odometry", {
            "header": stamp(i), "child_frame_id": "base_link", "pose": {"pose": pose},
            "twist": {"twist": twist}}),
        "/vel": ("geometry_msgs/msg/TwistStamped", {"header": stamp(i), "twist": twist}),
        "/pose": ("geometry_msgs/msg/PoseStamped", {"header": stamp(i), "pose": pose}),
        "/rudder": ("std_msgs/msg/Float64", {"data": 0.1 * i}),
        "/thrust": ("std_msgs/msg/Float32MultiArray", {"data": [0.5 * i, -0.5 * i]}),
        "/joints": ("sensor_msgs/msg/JointState", {
            "header": stamp(i), "name": ["left", "right"], "position": [0.1, 0.2 * i], "velocity": [],
            "effort": []}),
    }  # fmt: skip


def without_chunks(raw: bytes) -> bytes:
    file = io.BytesIO()
    writer = Writer(file, use_chunking=False)
    writer.start()
    numbers: dict[int, int] = {}
    for schema, channel, message in make_reader(io.BytesIO(raw)).iter_messages():
        if channel.id not in numbers:
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            numbers[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
        writer.add_message(numbers[channel.id], message.log_time, message.data, message.publish_time)
    writer.finish()
    return file.getvalue()


def recording(n: int = 40, **options: object) -> bytes:
    file = io.BytesIO()
    writer = Ros2Writer(file, **options)
    schemas: dict[str, object] = {}
    for i in range(n):
        for topic, (kind, content) in messages(i).items():
            if kind not in schemas:
                schemas[kind] = writer.register_msgdef(kind, text_of(kind))
            writer.write_message(topic, schemas[kind], content, log_time=T0 + i * 100_000_000, publish_time=0)
    writer.finish()
    return file.getvalue()


def decode(raw: bytes) -> Decoded:
    return MCAP.read(Path("x.mcap"), memoryview(raw), ReadOptions())


def flat(value: object, path: str = "") -> dict[str, object]:
    if hasattr(value, "__slots__"):
        return {
            k: v
            for s in value.__slots__
            for k, v in flat(getattr(value, s), f"{path}.{s}" if path else s).items()
        }
    if isinstance(value, (list, tuple, np.ndarray)):
        return {k: v for i, x in enumerate(value) for k, v in flat(x, f"{path}[{i}]").items()}
    return {path: value}


def assert_as_the_peer_reads_it(raw: bytes, but: tuple[str, ...] = ()) -> None:
    decoded = decode(raw)
    row: dict[str, int] = {}
    reader = make_reader(io.BytesIO(raw), decoder_factories=[DecoderFactory()])
    for _, channel, message, content in reader.iter_decoded_messages():
        topic = channel.topic
        at = row.get(topic, 0)
        row[topic] = at + 1
        table = decoded.tables[topic]
        ours = table.iloc[at]
        assert table.index[at] == message.log_time
        theirs = flat(content)
        second, part = theirs.pop("header.stamp.sec", None), theirs.pop("header.stamp.nanosec", None)
        if second is not None:
            assert ours["stamp_ns"] == second * 1_000_000_000 + part
        for name, value in theirs.items():
            if not name.startswith(but or ("\0",)):
                assert ours[name] == value, f"{topic}.{name}"
    assert row == {t: len(v) for t, v in decoded.tables.items()}


@pytest.mark.parametrize("compression", list(CompressionType))
def test_every_field_as_mcap_ros2_has_it(compression):
    assert_as_the_peer_reads_it(recording(compression=compression, chunk_size=4000))


def test_without_chunks():
    assert_as_the_peer_reads_it(without_chunks(recording()))


def test_arrays_texts_and_small_types():
    file = io.BytesIO()
    writer = Ros2Writer(file)
    parts = [ODD, "std_msgs/msg/Header", "builtin_interfaces/msg/Time", "geometry_msgs/msg/Point"]
    rest = [f"MSG: {p.replace('/msg/', '/')}\n{text_of(p).split('=====')[0]}" for p in parts[1:]]
    schema = writer.register_msgdef("odd_msgs/msg/Odd", ("=" * 80 + "\n").join([ODD, *rest]))
    for i in range(12):
        content = {
            "header": stamp(i), "small": -i, "large": 2**40 + i, "flag": i % 2 == 1, "single": 0.1 * i,
            "names": ["é" * i, "b"][: i % 3], "values": [1.5 * k for k in range(i % 4)],
            "corners": [{"x": k, "y": -k, "z": 0.5} for k in range(i % 3)], "image": bytes(500 + i),
            "tail": f"end{i}",
        }  # fmt: skip
        writer.write_message("/odd", schema, content, log_time=T0 + i, publish_time=0)
    writer.finish()
    raw = file.getvalue()
    assert_as_the_peer_reads_it(raw, but=("image", "names"))
    decoded = decode(raw)
    assert not [c for c in decoded.tables["/odd"].columns if c.startswith("image")]
    assert np.isnan(decoded.tables["/odd"]["corners[1].x"].iloc[0])
    assert any("image" in f.message for f in decoded.findings)


def test_quantities():
    decoded = decode(recording())
    best: dict[str, object] = {}
    for source in decoded.sources:
        best.setdefault(source.quantity, source)
    assert best["position"].name == "/gps/fix.latitude + /gps/fix.longitude"
    assert (best["heading"].topic, best["heading"].options["frame"]) == ("/imu", "enu")
    assert (best["yaw_rate"].topic, best["yaw_rate"].unit) == ("/imu", "rad/s")
    assert best["velocity"].fields == {"north": "twist.linear.y", "east": "twist.linear.x"}
    body = next(s for s in decoded.sources if s.topic == "/odom" and s.quantity == "velocity")
    assert body.fields == {"forward": "twist.twist.linear.x", "starboard": "twist.twist.linear.y"}
    np.testing.assert_allclose(decoded.tables["/imu"]["yaw"], 0.01 * np.arange(40), atol=1e-12)
    assert decoded.utc_of_index_zero_ns == 0


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("share", [0.3, 0.7, 0.95])
def test_an_unfinished_file_is_read_up_to_the_break(compression, share):
    raw = recording(200, compression=compression, chunk_size=20_000)
    decoded = decode(raw[: int(len(raw) * share)])
    assert decoded.messages > 1600 * (share - 0.25)
    assert decoded.messages == 1600 or "truncated" in {f.kind for f in decoded.findings}
    whole = decode(raw).tables["/imu"]
    table = decoded.tables["/imu"]
    np.testing.assert_array_equal(table["angular_velocity.z"], whole["angular_velocity.z"].iloc[: len(table)])


def test_a_flipped_byte_is_found_by_the_checksum():
    raw = bytearray(recording(100, compression=CompressionType.NONE, chunk_size=8000))
    at = raw.index(struct.pack("<d", 60.0 + 50e-6))
    raw[at + 2] ^= 0x10
    decoded = decode(bytes(raw))
    assert decoded.messages == 800
    damaged = [f for f in decoded.findings if f.kind == "damaged"]
    assert len(damaged) == 1
    assert damaged[0].offset < at < damaged[0].offset + damaged[0].length


def test_a_length_that_lies_costs_no_memory_and_hides_nothing_after_its_chunk():
    raw = bytearray(recording(200, compression=CompressionType.LZ4, chunk_size=8000))
    chunk = raw.index(b"\x06", 2000)
    while (
        raw[chunk + 41 : chunk + 48] != b"\x03\x00\x00\x00lz4"
        and raw[chunk + 37 : chunk + 44] != b"\x03\x00\x00\x00lz4"
    ):
        chunk = raw.index(b"\x06", chunk + 1)
    raw[chunk + 1 : chunk + 9] = b"\xff" * 7 + b"\x7f"
    decoded = decode(bytes(raw))
    assert decoded.messages > 1400
    assert decoded.tables["/imu"].index[-1] == T0 + 199 * 100_000_000


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("chunked", [True, False])
def test_damage_anywhere(seed, chunked):
    rng = random.Random(seed)
    raw = bytearray(recording(60, compression=CompressionType.NONE, chunk_size=6000))
    raw = raw if chunked else bytearray(without_chunks(bytes(raw)))
    at = rng.randrange(20_000, len(raw) - 20_000)
    raw[at : at + 8] = rng.randbytes(8)
    decoded = decode(bytes(raw))
    assert decoded.messages >= 480 - 3
    raw[at : at + 3] = b""
    assert decode(bytes(raw)).messages >= 480 - 70


@given(st.binary(max_size=300))
@settings(max_examples=100, deadline=None)
def test_junk_raises_nothing_but_value_error(junk):
    for reader in READERS:
        assert 0.0 <= reader.sniff(junk) <= 1.0
    for raw in (b"\x89MCAP0\r\n" + junk, SMALL[:2000] + junk, SMALL[: len(SMALL) // 2] + junk):
        try:
            decode(raw)
        except ValueError as error:
            assert "no message" in str(error)


SMALL = recording(12)


def test_a_garbled_definition():
    raw = recording(12, compression=CompressionType.NONE)
    standard = decode(raw.replace(b"float64 longitude", b"float64 #\x01ngitude"))
    assert len(standard.tables["/gps/fix"]) == 12
    assert any("garbled" in f.message for f in standard.findings)


@pytest.mark.parametrize("seed", range(40))
def test_any_damage_raises_nothing_but_value_error(seed):
    rng = random.Random(seed)
    raw = bytearray(SMALL if seed % 2 else without_chunks(SMALL))
    for _ in range(rng.choice([1, 5, 25])):
        at = rng.randrange(8, len(raw) - 20)
        choice = rng.randrange(4)
        if choice == 0:
            raw[at] = rng.randrange(256)
        elif choice == 1:
            raw[at:at] = rng.randbytes(9)
        elif choice == 2:
            del raw[at : at + 9]
        else:
            raw[at : at + 8] = b"\xff" * 8
    try:
        assert decode(bytes(raw)).messages
    except ValueError as error:
        assert "no message" in str(error)


def test_json():
    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    schema = writer.register_schema("foxglove.LocationFix", "jsonschema", b"{}")
    channel = writer.register_channel("/fix", "json", schema)
    for i in range(10):
        content = {
            "timestamp": {"sec": 1_717_200_000 + i, "nsec": 5}, "latitude": 60.0 + i, "longitude": 10.0,
            "position_covariance": [1, 2, 3], "frame_id": "gps", "nested": {"deep": {"x": i}},
        }  # fmt: skip
        raw = json.dumps(content).encode() if i != 4 else b"{broken"
        writer.add_message(channel, T0 + i, raw, T0 + i)
    writer.finish()
    decoded = decode(file.getvalue())
    table = decoded.tables["/fix"]
    assert len(table) == 9
    assert table["nested.deep.x"].tolist() == [0, 1, 2, 3, 5, 6, 7, 8, 9]
    assert decoded.sources[0].fields == {"latitude": "latitude", "longitude": "longitude"}
    assert decoded.sources[0].options["time"] == "stamp_ns"
    assert table["stamp_ns"].iloc[0] == T0 + 5
    assert [f.count for f in decoded.findings if f.kind == "damaged"] == [1]


def json_table(*texts: bytes) -> tuple[pd.DataFrame, list[bool]]:
    ends = np.cumsum([len(t) for t in texts])
    data = np.frombuffer(b"".join(texts), np.uint8)
    table, good = json_columns(data, ends - [len(t) for t in texts], ends)
    return table, good.tolist()


def test_json_of_changing_shape():
    table, good = json_table(
        b'{"a": 1, "b": [1, {"c": 2}], "d": "x", "e": true}', b'{"a": 2.5, "b": [3], "d": 7, "e": null, "f": {}}', b"3",
        b'{"a": {"z": 1e999}, "g": 99999999999999999999, "h": %s}' % (b"1" + b"0" * 400),
    )  # fmt: skip
    assert good == [True] * 4
    np.testing.assert_array_equal(table["a"], [1, 2.5, np.nan, np.nan])
    np.testing.assert_array_equal(table["b[0]"], [1, 3, np.nan, np.nan])
    np.testing.assert_array_equal(table["b[1].c"], [2, np.nan, np.nan, np.nan])
    assert table["d"].tolist()[:2] == ["x", "7"]
    assert table["data"].tolist()[2] == 3 and table["a.z"].tolist()[3] == np.inf
    assert table["g"].tolist()[3] == 1e20


def test_json_without_its_stamps():
    table, _ = json_table(
        b'{"timestamp": {"sec": 3, "nsec": 4}}', b'{"timestamp": 5}', b'{"timestamp": {"sec": 1}}'
    )
    assert table["stamp_ns"].tolist() == [3_000_000_004, 0, 1_000_000_000]
    table, _ = json_table(b'{"timestamp": {"sec": "3", "nsec": 4}, "x": 1}')
    assert "stamp_ns" not in table


@pytest.mark.parametrize(
    "texts",
    [[b'{"a":[{}', b"{}]}", b"{},{}"], [b"1,2", b"[3", b"4]"], [b"", b"{}"], [b"[" * 100_000, b'{"a": 1}']],
)  # fmt: skip
def test_broken_json_takes_nothing_from_its_neighbours(texts):
    def whole(text):
        try:
            json.loads(text)
        except (ValueError, RecursionError):
            return False
        return True

    assert json_table(*texts, b'{"a": 5}')[1] == [*map(whole, texts), True]


def test_protobuf():
    file_set = descriptor_pb2.FileDescriptorSet()
    description = file_set.file.add(name="fix.proto", package="foxglove", syntax="proto3")
    kind = description.message_type.add(name="LocationFix")
    for number, (name, what, label) in enumerate(
        [
            ("latitude", 1, 1),
            ("longitude", 1, 1),
            ("frame_id", 9, 1),
            ("position_covariance", 1, 3),
            ("fixed", 5, 1),
        ],
        1,
    ):
        kind.field.add(name=name, number=number, type=what, label=label)
    inner = kind.nested_type.add(name="Inner")
    inner.field.add(name="x", number=1, type=1, label=1)
    kind.field.add(name="inner", number=9, type=11, label=1, type_name=".foxglove.LocationFix.Inner")
    pool = descriptor_pool.DescriptorPool()
    pool.Add(description)
    cls = message_factory.GetMessageClass(pool.FindMessageTypeByName("foxglove.LocationFix"))
    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    schema = writer.register_schema("foxglove.LocationFix", "protobuf", file_set.SerializeToString())
    channel = writer.register_channel("/fix", "protobuf", schema)
    for i in range(10):
        message = cls(
            latitude=60.0 + i, longitude=10.0, frame_id="gps", position_covariance=[0.5, i], fixed=-i
        )
        if i % 2:
            message.inner.x = i
        writer.add_message(channel, T0 + i, message.SerializeToString(), T0 + i)
    writer.add_message(channel, T0 + 11, b"\xff\xff\xff", T0 + 11)
    writer.finish()
    decoded = decode(file.getvalue())
    table = decoded.tables["/fix"]
    assert table["latitude"].tolist() == [60.0 + i for i in range(10)]
    assert table["position_covariance[1]"].tolist() == [float(i) for i in range(10)]
    assert table["fixed"].tolist() == [-i for i in range(10)]
    assert table["inner.x"].tolist()[1::2] == [1.0, 3.0, 5.0, 7.0, 9.0]
    assert np.isnan(table["inner.x"].iloc[0])
    assert decoded.sources[0].quantity == "position"


def test_a_bag(tmp_path):
    path = tmp_path / "drive_0.db3"
    with sqlite3.connect(path) as bag:
        bag.execute(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)"
        )
        bag.execute(
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
        )
        bag.execute("INSERT INTO topics VALUES(1, '/rudder', 'std_msgs/msg/Float64', 'cdr')")
        bag.execute("INSERT INTO topics VALUES(2, '/vel', 'geometry_msgs/msg/TwistStamped', 'cdr')")
        float64 = STORE.types["std_msgs/msg/Float64"]
        for i in range(20):
            raw = bytes(STORE.serialize_cdr(float64(data=0.5 * i), "std_msgs/msg/Float64"))
            bag.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(1, ?, ?)", (T0 + i, raw))
        bag.execute(
            "INSERT INTO messages(topic_id, timestamp, data) VALUES(2, ?, ?)", (T0 + 99, b"\x00\x01\x00")
        )
    bag.close()
    log = read_log(path)
    assert log.format == "rosbag2"
    assert log.tables["/rudder"]["data"].tolist() == [0.5 * i for i in range(20)]
    assert [f.topic for f in log.findings if f.kind == "damaged"] == ["/vel"]


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


def test_only_the_topics_that_are_wanted(tmp_path):
    path = tmp_path / "x.mcap"
    path.write_bytes(recording())
    log = read_log(path, topics=["/imu"])
    assert list(log.tables) == ["/imu"]
    assert log.format == "mcap"


def test_nothing_usable(tmp_path):
    path = tmp_path / "x.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + bytes(1000))
    with pytest.raises(UnreadableLog, match="mcap"):
        read_log(path)
