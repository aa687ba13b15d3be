"""MCAP recordings for tests, written by the peers."""

import io
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from ingest import ReadOptions
from ingest.reader import Decoded
from ingest.ros.readers import MCAP

T0 = 1_717_200_000_000_000_000
STORE = get_typestore(Stores.ROS2_HUMBLE)


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
