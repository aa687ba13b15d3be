"""The file of a capture: whole after every write, mended where it is cut off."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from capture_samples import SCRIPT, raw_bytes
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.serial_line import block_of
from ingest.errors import UsageError
from seatrial.capture.channel_messages import (
    EVENTS,
    TableEncoder,
    event_message,
    status_channel,
    status_message,
)
from seatrial.capture.live_decoding import PortDecoder
from seatrial.capture.recording_file import Message, RecordingFile
from seatrial.capture.records import ChannelSpec
from seatrial.capture.recovery import recover
from seatrial.capture.session import decoded_messages
from seatrial.capture.settings import PortSettings, Protocol

SECOND = 1_000_000_000
RAW = ChannelSpec("/raw/gps", "raw", metadata=(("protocol", "nmea"), ("baud", "115200")))


def test_the_file_is_an_mcap_by_the_reference_reader(tmp_path):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    path = tmp_path / "a.mcap"
    table = pd.DataFrame(
        {"speed": [1.5, np.nan], "talker": pd.Categorical(["GP", None]), "rpm[0]": [3, 4]},
        index=pd.Index([SECOND, 2 * SECOND], name="t_ns"),
    )
    encoded = TableEncoder("gps").encode("VTG", table, {("VTG", "speed"): "m/s"})
    file = RecordingFile(path)
    for k in range(3):
        file.append([Message(RAW, k * SECOND + 5, k, bytes([k]) * 100)])
    file.append(
        [Message(encoded.channel, t, t, p) for t, p in zip(encoded.times, encoded.payloads, strict=True)]
    )
    file.finish()
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = reader.get_summary()
        assert found.statistics.message_count == 5
        assert len(found.chunk_indexes) == 4
        raw = list(reader.iter_messages(topics=["/raw/gps"]))
        rows = [m for _, _, _, m in reader.iter_decoded_messages(topics=["/gps/VTG"])]
    assert [(m.log_time, m.publish_time, m.data) for _, _, m in raw] == [
        (k * SECOND + 5, k, bytes([k]) * 100) for k in range(3)
    ]
    assert (rows[0].speed, rows[0].talker, rows[0].rpm_0) == (1.5, "GP", 3.0)
    assert np.isnan(rows[1].speed) and rows[1].talker == ""
    assert b"# m/s" in encoded.channel.definition


def test_new_columns_make_a_new_channel_of_the_topic():
    encoder, index = TableEncoder("a"), pd.Index([1], name="t_ns")
    first = encoder.encode("X", pd.DataFrame({"a": [1.0], "b": ["x"]}, index=index), {})
    same = encoder.encode("X", pd.DataFrame({"a": [2.0]}, index=index), {})
    more = encoder.encode("X", pd.DataFrame({"c": [3.0]}, index=index), {})
    assert first.channel == same.channel != more.channel
    assert first.channel.topic == more.channel.topic == "/a/X"
    assert encoder.encode("X", pd.DataFrame({"a": []}, index=pd.Index([], dtype="int64")), {}) is None


@given(keep=st.floats(0.0, 1.0))
@settings(max_examples=30, deadline=None)
def test_cut_anywhere_a_file_gives_every_whole_chunk(keep, tmp_path_factory):
    folder = tmp_path_factory.mktemp("cut")
    file, ends = RecordingFile(folder / "a.mcap"), []
    rng = np.random.default_rng(3)
    for k in range(5):
        file.append([Message(RAW, SECOND * (k + 1), k, rng.integers(0, 256, 300, np.uint8).tobytes())])
        ends.append(file.size)
    file.finish()
    data = (folder / "a.mcap").read_bytes()
    size = max(int(keep * len(data)), ends[0])
    cut = folder / "b.mcap"
    cut.write_bytes(data[:size])
    done = recover(cut)
    whole = sum(e <= size for e in ends)
    assert whole <= done.messages <= whole + 1
    kept = raw_bytes(done.path)["/raw/gps"]
    assert kept == raw_bytes(folder / "a.mcap")["/raw/gps"][: len(kept)]
    assert (done.path == cut) == (not done.findings)


def test_recover_says_what_it_cannot_do(tmp_path):
    with pytest.raises(UsageError, match="no such file"):
        recover(tmp_path / "a.mcap")
    path = tmp_path / "b.mcap"
    path.write_bytes(b"")
    done = subprocess.run([SCRIPT, "recover", path], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "no usable record" in done.stderr and "Traceback" not in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["b.mcap"]


def test_rerun_and_foxglove_have_all_they_need_to_open_a_capture(tmp_path):
    """The viewer's own reader checks the file and decodes its messages by the definitions in it."""
    rerun = shutil.which("rerun", path=str(Path(sys.executable).parent))
    if rerun is None:
        pytest.skip("the rerun command is not installed beside Python")
    path, decoder = tmp_path / "a.mcap", PortDecoder(PortSettings("/dev/a", 115200, Protocol.nmea, "gps"))
    file, data = RecordingFile(path), block_of("mixed", 6000)
    file.append([Message(RAW, SECOND + i, SECOND + i, data[i : i + 100]) for i in range(0, len(data), 100)])
    for encoded in decoder.feed([(2 * SECOND, data)]).messages:
        file.append(decoded_messages(encoded))
    values, event = (5.0, 1.0, 2.0, 0.0, 0.1, 1.0), event_message(SECOND, 3, "gps", "mute: no byte for 5 s")
    file.append([Message(status_channel("gps"), SECOND, SECOND, status_message(values))])
    file.append([Message(EVENTS, SECOND, SECOND, event)])
    file.finish()
    environment = {**os.environ, "HOME": str(tmp_path)}
    checked = subprocess.run([rerun, "mcap", "check", path], capture_output=True, text=True, env=environment)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    command = [rerun, "mcap", "convert", path, "-o", tmp_path / "a.rrd"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    found = columns_of(tmp_path / "a.rrd")
    assert {"/gps/GGA:seatrial.msg.GGA:message", "/gps/NAV-PVT:seatrial.msg.NAV_PVT:message"} <= found
    assert {"/capture/events:TextLog:text", "/capture/gps:seatrial.msg.PortStatus:message"} <= found
    assert any(c.startswith("/raw/gps:") for c in found)


def columns_of(path):
    from rerun.chunk import RrdReader

    return {
        f"{chunk.entity_path}:{name}"
        for chunk in RrdReader(path).stream().to_chunks()
        for name in chunk.to_record_batch().schema.names
    }
