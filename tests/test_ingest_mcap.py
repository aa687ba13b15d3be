"""MCAP files with ROS 2 messages: values against the peers; unfinished and damaged files."""

import io
import random
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer as Ros2Writer
from ros_samples import T0, decode, recording, stamp, text_of, without_chunks

from ingest import UnreadableLog, read_log
from ingest.ros import READERS

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


@pytest.mark.parametrize(
    ("compression", "most"), [(CompressionType.NONE, 1_000), (CompressionType.LZ4, 20_000)]
)
def test_of_a_chunk_that_is_cut_off_only_what_was_not_read_counts_as_damaged(compression, most):
    raw = recording(200, compression=compression, chunk_size=1 << 20)
    decoded = decode(raw[: len(raw) * 3 // 5])
    assert decoded.messages > 500
    assert decoded.bytes_damaged < most
    assert decoded.bytes_damaged == sum(f.length or 0 for f in decoded.findings)


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
