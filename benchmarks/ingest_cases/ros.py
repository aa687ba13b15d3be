"""MCAP with ROS 2 CDR against the mcap_ros2 decoder; the log is written by mcap_ros2."""

from __future__ import annotations

import math
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


CASES = (Case("mcap ROS 2 CDR", "mcap_ros2 decoder", 3, make_mcap, ours, peer_mcap),)
