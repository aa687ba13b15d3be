"""MCAP with ROS 2 CDR against the mcap_ros2 decoder; the log is written by mcap_ros2."""

from __future__ import annotations

import math
import struct
from pathlib import Path

from benchmarks.ingest_cases import Case


def ours(path: Path) -> int:
    from ingest import read_log

    return read_log(path).messages


def make_mcap(folder: Path, scale: float) -> Path:
    from mcap_ros2.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    path = folder / "bench.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        kinds = ("sensor_msgs/msg/Imu", "sensor_msgs/msg/NavSatFix", "std_msgs/msg/Float32MultiArray")
        schemas = [writer.register_msgdef(k, store.generate_msgdef(k, ros_version=2)[0]) for k in kinds]
        for i in range(int(60_000 * scale)):
            header = {
                "stamp": {"sec": 1_700_000_000 + i // 100, "nanosec": i % 100 * 10_000_000},
                "frame_id": "base",
            }
            imu = {
                "header": header, "orientation": {"z": math.sin(i / 2e3), "w": math.cos(i / 2e3), "x": 0.0,
                    "y": 0.0},
                "angular_velocity": {"x": 0.1, "y": 0.2, "z": i * 1e-3},
            }  # fmt: skip
            fix = {"header": header, "latitude": 63.0 + i * 1e-7, "longitude": 10.0, "altitude": 2.0}
            contents = (("/imu", imu), ("/fix", fix), ("/thrust", {"data": [0.1 * i, 0.2]}))
            for (topic, content), schema in zip(contents, schemas, strict=True):
                writer.write_message(
                    topic, schema, content, log_time=1_700_000_000_000_000_000 + i * 10_000_000
                )
        writer.finish()
    return path


def peer_mcap(path: Path) -> int:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    rows: dict[str, list[object]] = {}
    with path.open("rb") as file:
        for _, channel, _, message in make_reader(
            file, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages():
            rows.setdefault(channel.topic, []).append(message)
    return sum(map(len, rows.values()))


def make_plain(folder: Path, scale: float) -> Path:
    """The same without chunks and without an end, so that it can be cut into records."""
    from mcap.reader import make_reader
    from mcap.writer import Writer

    source, path = make_mcap(folder, scale / 4), folder / "plain.mcap"
    with source.open("rb") as file, path.open("wb") as out:
        reader, writer = make_reader(file), Writer(out, use_chunking=False)
        writer.start()
        numbers = {}
        for schema, channel, message in reader.iter_messages():
            if channel.topic not in numbers:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[channel.topic] = writer.register_channel(channel.topic, "cdr", number)
            writer.add_message(numbers[channel.topic], message.log_time, message.data, message.publish_time)
        writer.finish()
    return path


def peer_stream(path: Path) -> int:
    """What the reader that needs no index gives before it stops."""
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader
    from mcap_ros2.decoder import DecoderFactory

    count = 0
    with path.open("rb") as file:
        reader = NonSeekingReader(file, decoder_factories=[DecoderFactory()])
        try:
            for _ in reader.iter_decoded_messages(log_time_order=False):
                count += 1
        except (McapError, ValueError, KeyError, IndexError, struct.error, MemoryError):
            pass
    return count


def mcap_records(data: bytes) -> list[bytes]:
    """All up to the first message that has every channel before it, and then a message each."""
    pieces, p = [], 8
    while p < len(data) and data[p] != 0x0F:
        n = 9 + int.from_bytes(data[p + 1 : p + 9], "little")
        pieces.append(data[p : p + n])
        p += n
    first = 1 + max(i for i, piece in enumerate(pieces) if piece[0] != 0x05)
    return [data[:8] + b"".join(pieces[:first]), *pieces[first:]]


CASES = (
    Case("mcap ROS 2 CDR", "mcap_ros2 decoder", 3, make_mcap, ours, peer_mcap),
    Case("mcap, no chunks", "mcap_ros2 decoder", 0.0, make_plain, ours, peer_stream, mcap_records, False),
)
