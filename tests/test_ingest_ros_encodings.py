"""Messages in JSON and protobuf, and ROS 2 bags in SQLite."""

import io
import json
import sqlite3

import numpy as np
import pandas as pd
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import Writer
from ros_samples import STORE, T0, decode

from ingest import read_log
from ingest.ros.json_columns import columns_of as json_columns


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
