"""Live capture against real pseudo terminals and real processes, killed for real."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from multiprocessing import Pipe

import numpy as np
import pandas as pd
import pytest
from capture_samples import SCRIPT, Device, capturing, ended, lines_until, raw_bytes, read_findings
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.serial_line import block_of, nmea, nmea_record
from ingest import read_log
from ingest.errors import CampaignError, UsageError
from ingest.ros.records import Contents
from seatrial.capture.can_adapter import SlcanDecoder
from seatrial.capture.channel_messages import TableEncoder
from seatrial.capture.clocks import HostClock
from seatrial.capture.decoder_process import Inbox
from seatrial.capture.decoders import SerialDecoder, decoder_for
from seatrial.capture.detection import detect, suspicion
from seatrial.capture.imu_text import ImuDecoder
from seatrial.capture.live_decoding import PortDecoder
from seatrial.capture.piece_buffer import PieceBuffer
from seatrial.capture.playback import recorded_ports
from seatrial.capture.recording_file import Message, RecordingFile
from seatrial.capture.records import ChannelSpec
from seatrial.capture.recovery import mapped, messages, recover
from seatrial.capture.settings import PortSettings, Protocol
from seatrial.capture.settings_file import Wanted, settings_from

SECOND = 1_000_000_000
RAW = ChannelSpec("/raw/gps", "raw", metadata=(("protocol", "nmea"), ("baud", "115200")))


# --- the command, its processes and devices ---------------------------------------------------------------


@pytest.fixture
def device(tmp_path):
    made: list[Device] = []

    def make(name: str) -> Device:
        made.append(Device(tmp_path / name))
        return made[-1]

    yield make
    for one in made:
        with contextlib.suppress(OSError):
            os.close(one.master)


def test_several_ports_are_kept_byte_for_byte_decoded_and_read(device, tmp_path):
    ports = {name: device(name) for name in ("nmea", "ubx", "mavlink", "imu")}
    out = tmp_path / "trial.mcap"
    words = [w for line in ports.values() for w in ("--port", line.link)]
    with capturing(*words, "--baud", 115200, "--out", out) as process:
        talking = [line.talk(block_of(name, 1 << 14), 2.0) for name, line in ports.items()]
        for thread in talking:
            thread.join()
        time.sleep(0.3)
        summary, said = ended(process)
    assert process.returncode == 0
    kept = raw_bytes(out)
    for name, line in ports.items():
        assert line.sent > 5000
        assert len(kept[f"/raw/{name}"]) == line.sent
        assert name in summary
        assert line.received() == b""
    for words in ("nmea: speaks NMEA 0183", "ubx: speaks UBX", "mavlink: speaks MAVLink", "imu: speaks text"):
        assert words in said
    log = read_log(out)
    assert log.utc_ns == pytest.approx(time.time_ns(), abs=60 * SECOND)
    assert {s.quantity for s in log.sources} >= {"position", "heading", "yaw_rate", "velocity"}
    for topic in ("GGA", "NAV-PVT", "ATTITUDE"):
        beside = next(f for f in log.findings if f.kind == "note" and (f.topic or "").endswith(f"/{topic}"))
        assert len(log.tables[topic]) >= beside.count > 10
    assert len(log.tables["YPR"]) > 50
    live = read_log(out, topics=["/nmea/HDT"]).tables["/nmea/HDT"]
    assert (live["headingT"].to_numpy()[:5] == log.tables["HDT"]["headingT"].to_numpy()[:5]).all()


def test_killed_it_loses_half_a_second_at_most(device, tmp_path):
    line, out = device("gps"), tmp_path / "killed.mcap"
    with capturing("--port", line.link, "--baud", 115200, "--out", out) as process:
        line.wait_for_reader()
        sent, end = [], time.monotonic() + 2.5
        while time.monotonic() < end:
            line.write(nmea_record(len(sent)))
            sent.append((time.monotonic(), line.sent))
            time.sleep(0.02)
        killed = time.monotonic()
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    safe = max((total for at, total in sent if at < killed - 0.5), default=0)
    kept = raw_bytes(out)["/raw/gps"]
    assert len(kept) >= safe > 10_000
    assert len(kept) <= line.sent
    assert any("not finished" in f.message for f in read_log(out).findings)
    assert len(read_log(out).tables["HDT"]) > 50
    mended = subprocess.run([SCRIPT, "recover", out], capture_output=True, text=True, check=True)
    whole = tmp_path / "killed-recovered.mcap"
    assert str(whole) in mended.stdout
    assert raw_bytes(whole) == {"/raw/gps": kept}
    assert not read_log(whole).findings or all(
        "not finished" not in f.message for f in read_log(whole).findings
    )


def test_unplugged_and_plugged_in_again(device, tmp_path):
    line, out = device("gps"), tmp_path / "a.mcap"
    with capturing("--port", line.link, "--baud", 4800, "--out", out, "--no-decode") as process:
        line.wait_for_reader()
        line.write(first := nmea("HEHDT,10.0,T") * 20)
        time.sleep(0.5)
        line.unplug()
        lines_until(process, "unplugged")
        time.sleep(0.3)
        line.plug()
        lines_until(process, "is back")
        time.sleep(0.2)
        line.write(second := nmea("HEHDT,20.0,T") * 20)
        time.sleep(0.5)
        summary, _ = ended(process, signal.SIGTERM)
    assert process.returncode == 0
    assert "unplugged 1 time" in summary
    assert raw_bytes(out)["/raw/gps"] == first + second


def test_mute_then_garbage_then_good(device, tmp_path):
    line, out = device("gps"), tmp_path / "a.mcap"
    config = tmp_path / "capture.toml"
    config.write_text(
        f'out = "a.mcap"\nmute = 0.5\n[[port]]\ndevice = "{line.link}"\nbaud = 9600\nname = "bow"\n',
        encoding="utf-8",
    )
    with capturing(config) as process:
        lines_until(process, "mute: no byte")
        garbage = np.random.default_rng(1).integers(128, 256, 3000, np.uint8).tobytes()
        line.write(garbage)
        lines_until(process, "right baud rate")
        good = block_of("nmea", 6000)
        for at in range(0, len(good), 1000):
            line.write(good[at : at + 1000])
            time.sleep(0.05)
        lines_until(process, "speaks NMEA 0183")
        ended(process, signal.SIGHUP)
    assert process.returncode == 0
    assert raw_bytes(out)["/raw/bow"] == garbage + good
    events = read_log(out).tables["/capture/events"]["msg"].astype(str)
    assert events.str.contains("mute").any() and events.str.contains("9600").any()
    assert len(read_log(out).tables["GGA"]) > 20


def test_a_full_disk_is_said_and_the_file_is_still_good(device, tmp_path):
    line, out = device("gps"), tmp_path / "full.mcap"
    noise = np.random.default_rng(1).integers(0, 256, 200_000, np.uint8).tobytes()
    with capturing(
        "--port", line.link, "--baud", 921600, "--out", out, "--no-decode", limit=60_000
    ) as process:
        line.talk(noise, 1.5, 921_600).join()
        lines_until(process, "nothing can be written")
        _, said = ended(process)
    assert process.returncode == 1
    assert "could not be written" in said
    kept = raw_bytes(out)["/raw/gps"]
    assert 20_000 < len(kept) < 60_000
    assert noise.startswith(kept)


def test_files_rotate_and_nothing_is_between_them(device, tmp_path):
    line = device("gps")
    noise = np.random.default_rng(1).integers(0, 256, 200_000, np.uint8).tobytes()
    options = ("--rotate-size", 0.03, "--no-decode", "--duration", 3)
    with capturing("--port", line.link, "--baud", 921600, "--out", tmp_path / "t.mcap", *options) as process:
        line.talk(noise, 1.2, 921_600).join()
        ended(process, None)
    files = sorted(tmp_path.glob("t-*.mcap"))
    assert len(files) >= 3
    assert files[0].name == "t-001.mcap"
    assert not any(read_findings(f) for f in files)
    parts = [
        m.payload for f in files for m in messages(mapped(f), Contents()) if m.channel.topic == "/raw/gps"
    ]
    assert b"".join(parts) == noise[: line.sent]


def test_a_device_that_never_speaks_is_status_one(device, tmp_path):
    line = device("gps")
    options = ("--duration", 0.5, "--no-decode")
    with capturing("--port", line.link, "--baud", 9600, "--out", tmp_path / "a.mcap", *options) as process:
        out, err = ended(process, None)
    assert process.returncode == 1
    assert "no byte came" in out and "no byte came from any port" in err


def test_played_back_it_is_captured_again(tmp_path):
    out, link = tmp_path / "a.mcap", tmp_path / "port"
    file = RecordingFile(out)
    pieces = [nmea_record(i) for i in range(40)]
    file.append([Message(RAW, SECOND * 1_700_000_000 + i * SECOND // 40, 0, p) for i, p in enumerate(pieces)])
    file.finish()
    player = subprocess.Popen([SCRIPT, "replay", out, "--port", link], stdout=subprocess.PIPE, text=True)
    while not link.is_symlink():
        time.sleep(0.02)
    with capturing("--port", link, "--baud", 115200, "--out", tmp_path / "b.mcap", "--no-decode") as process:
        answer = player.communicate(timeout=20)[0]
        time.sleep(0.2)
        ended(process)
    assert raw_bytes(tmp_path / "b.mcap")["/raw/port"] == b"".join(pieces)
    times = recorded_ports(tmp_path / "b.mcap")[0].times
    assert 0.8e9 < times[-1] - times[0] < 2.0e9
    assert f"{sum(map(len, pieces)):,} bytes sent" in answer
    assert not link.is_symlink()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--port", "/dev/ttyNO7", "--baud", "9600"], "no such port"),
        (["--port", "{tmp}", "--baud", "9600"], "found a folder"),
        (["--port", "{tmp}/file", "--baud", "9600"], "found a file"),
        (["--port", "/dev/null"], "--baud"),
        (["--port", "/dev/null", "--baud", "7"], "from 50"),
        (["--port", "/dev/null", "--baud", "9600", "--protocol", "nema"], "Did you mean 'nmea'"),
        (["--port", "/dev/null", "--port", "/dev/null", "--baud", "9600"], "named twice"),
        (["--port", "/dev/null", "--baud", "9600", "--out", "{tmp}/old.mcap"], "not overwritten"),
        (["--port", "/dev/null", "--baud", "9600", "--out", "{tmp}/none/a.mcap"], "make it first"),
        (["--port", "/dev/null", "--baud", "9600", "--duration", "-1"], "positive"),
        (["{tmp}/none.toml"], "no such file"),
    ],
)
def test_what_is_wrong_is_said_before_anything_begins(words, expected, tmp_path, capsys):
    from seatrial.__main__ import main

    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "old.mcap").write_bytes(b"")
    with pytest.raises(SystemExit) as exit_:
        main(["capture", *(w.format(tmp=tmp_path) for w in words)])
    assert exit_.value.code == 2
    assert expected in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "old.mcap"]


# --- capture.toml -----------------------------------------------------------------------------------------


def test_the_command_line_wins_over_the_file(tmp_path):
    path = tmp_path / "capture.toml"
    path.write_text(
        'out = "day-{utc}.mcap"\nrotate_size = 2\nrotate_minutes = 1.5\nlive = true\n'
        '[[port]]\ndevice = "/dev/a"\nbaud = 4800\nprotocol = "nmea"\nname = "gps"\n'
        '[[port]]\ndevice = "/dev/b"\nbaud = 115200\n',
        encoding="utf-8",
    )
    found = settings_from(Wanted(path, rotate_size=5, no_decode=True))
    assert found.ports == (
        PortSettings("/dev/a", 4800, Protocol.nmea, "gps"),
        PortSettings("/dev/b", 115200, name="b"),
    )
    assert (found.rotate_bytes, found.rotate_s, found.live, found.decode) == (5e6, 90.0, True, False)
    assert found.out == tmp_path / "day-{utc}.mcap"
    assert settings_from(Wanted(path, ["/dev/c"], [9600])).ports == (PortSettings("/dev/c", 9600, name="c"),)


@pytest.mark.parametrize(
    ("text", "key", "near"),
    [
        ("[[prot]]", "prot", "port"),
        ('[[port]]\ndevice = "a"\nbuad = 3', "[[port]] 1: buad", "baud"),
        ('[[port]]\ndevice = "a"', "[[port]] 1: baud", None),
        ('[[port]]\ndevice = "a"\nbaud = "9600"', "[[port]] 1: baud", None),
        ('[[port]]\ndevice = "a"\nbaud = 9600\nprotocol = "mavlnk"', "[[port]] 1: protocol", "mavlink"),
        ("rotate_size = -1", "rotate_size", None),
        ("duration = true", "duration", None),
        ("out = ", "the file", None),
    ],
)
def test_a_wrong_file_is_told_where(text, key, near, tmp_path):
    path = tmp_path / "capture.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CampaignError) as error:
        settings_from(Wanted(path))
    assert (error.value.key, error.value.nearest_key) == (key, near)


# --- detection and decoding -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["nmea", "ubx", "mavlink", "imu", "slcan"])
@pytest.mark.parametrize("junk", [b"", b"\x00\xff\x13garbage$GP", b"\xb5\x62\x01"])
def test_a_protocol_is_told_from_its_bytes(name, junk):
    assert detect(junk + block_of(name, 800)[7:]) == Protocol[name]


def test_slcan_is_told_and_its_packets_survive_the_cuts():
    heading = b"T09F112248FF102700000000FC\r"
    fast = [b"T0DF805248%02X%s\r" % (0x40 + k, b"2B" + b"00" * 6 if k == 0 else b"01" * 7) for k in range(7)]
    data = heading * 3 + b"".join(fast) + heading
    assert detect(data) == Protocol.slcan
    whole = SlcanDecoder().feed([(SECOND, data)])
    cut = SlcanDecoder()
    parts = [cut.feed([(SECOND + i, data[i : i + 17])]) for i in range(0, len(data), 17)]
    assert whole.messages == sum(p.messages for p in parts) == 11
    assert set(whole.tables) == {t for p in parts for t in p.tables} >= {"vesselHeading"}
    for topic, table in whole.tables.items():
        pieces = pd.concat([p.tables[topic] for p in parts if topic in p.tables])
        assert len(pieces) == len(table)
        pd.testing.assert_frame_equal(
            pieces.reset_index(drop=True), table.reset_index(drop=True), check_dtype=False
        )


def test_no_protocol_in_noise_and_the_line_rate_is_doubted():
    noise = np.random.default_rng(2).integers(0, 256, 4000, np.uint8).tobytes()
    assert detect(noise) is None and detect(b"") is None
    assert "9600" in suspicion(noise, 9600)
    assert suspicion(noise[:100], 9600) is None
    assert "text" in suspicion(b"hello world this is a console\r\n" * 40, 9600)


@pytest.mark.parametrize("name", ["nmea", "ubx", "mavlink", "imu", "mixed", "slcan"])
def test_pieces_give_what_the_whole_gives(name):
    data = block_of(name, 3000)
    protocol = "nmea" if name == "mixed" else name
    whole = decoder_for(protocol).feed([(SECOND, data)])
    cut, tables, count = decoder_for(protocol), {}, 0
    for i in range(0, len(data), 37):
        found = cut.feed([(SECOND + i, data[i : i + 37])])
        count += found.messages
        assert found.damaged == 0
        for topic, table in found.tables.items():
            tables.setdefault(topic, []).append(table)
    assert count == whole.messages > 0
    assert {t: sum(map(len, p)) for t, p in tables.items()} == {t: len(x) for t, x in whole.tables.items()}
    for parts in tables.values():
        times = np.concatenate([p.index.to_numpy() for p in parts])
        assert (np.diff(times) >= 0).all() and times[-1] <= SECOND + len(data)


@given(cuts=st.lists(st.integers(1, 400), min_size=1, max_size=12), junk=st.binary(max_size=60))
@settings(max_examples=25, deadline=None)
def test_good_records_around_junk_are_decoded_however_it_is_cut(cuts, junk):
    record = nmea("HEHDT,123.4,T")
    data = record * 3 + junk + b"\r\n" + record * 3
    decoder, found, at = SerialDecoder(), 0, 0
    for size in [*cuts, len(data)]:
        if data[at : at + size]:
            tables = decoder.feed([(SECOND + at, data[at : at + size])]).tables
            found += len(tables.get("HDT", ()))
        at += size
    assert found == 6


@given(st.lists(st.binary(min_size=1, max_size=9), min_size=1, max_size=20), st.integers(0, 60))
@settings(max_examples=50, deadline=None)
def test_a_byte_keeps_its_time(pieces, drop):
    buffer, times = PieceBuffer(), []
    for i, data in enumerate(pieces):
        buffer.add([(i, data)])
        times += [i] * len(data)
    buffer.drop(drop := min(drop, len(times)))
    assert buffer.data == b"".join(pieces)[drop:]
    if buffer.data:
        ends = np.arange(1, len(buffer.data) + 1)
        assert buffer.times(ends).tolist() == times[drop:]


@pytest.mark.parametrize(
    ("line", "topic", "columns"),
    [
        (b"#YPR=12.5,-1.0,0.25\r\n", "YPR", {"value[0]": 12.5, "value[1]": -1.0, "value[2]": 0.25}),
        (b"!ANG:1.5,2.5,3.5\n", "ANG", {"value[0]": 1.5, "value[1]": 2.5, "value[2]": 3.5}),
        (b"1.0, 2.0; -3e-2\n", "IMU", {"value[0]": 1.0, "value[1]": 2.0, "value[2]": -0.03}),
        (b"yaw:12.5 pitch: -1.0 roll=0.25\n", "IMU", {"yaw": 12.5, "pitch": -1.0, "roll": 0.25}),
    ],
)
def test_text_of_inertial_sensors(line, topic, columns):
    found = ImuDecoder().feed([(SECOND, b"# started\n" + line * 2 + line[:4])])
    assert found.tables[topic].to_dict("records") == [columns] * 2
    assert found.damaged == len(b"# started\n")


def test_the_wrong_line_rate_is_doubted_once_and_again_after_good_records():
    decoder = PortDecoder(PortSettings("/dev/a", 9600, Protocol.nmea, "a"))
    noise = np.random.default_rng(2).integers(128, 256, 2048, np.uint8).tobytes()
    remarks = [r for i in range(6) for r in decoder.feed([(SECOND + i, noise)]).remarks]
    assert len(remarks) == 1 and "9600" in remarks[0]
    assert decoder.feed([(2 * SECOND, block_of("nmea", 500))]).remarks == ["good records again"]


def test_all_that_came_before_the_protocol_was_known_is_decoded():
    decoder = PortDecoder(PortSettings("/dev/a", 115200, Protocol.auto, "a"))
    data = block_of("nmea", 200_000)
    noise = np.random.default_rng(2).integers(128, 256, 20_000, np.uint8).tobytes()
    assert decoder.feed([(SECOND, noise)]).protocol is None
    found = decoder.feed([(SECOND + i, data[i : i + 997]) for i in range(0, len(data), 997)])
    assert found.protocol == Protocol.nmea
    assert found.records == data.count(b"$")
    assert sum(len(e.payloads) for e in found.messages) == found.records


def test_whoever_is_behind_gets_all_that_waits_at_once():
    here, there = Pipe()
    for k in range(5):
        here.send([(0, [(k, b"a")]), (k % 2, [(k, b"bc")])])
    here.send(None)
    ((count, batch),) = list(Inbox(there))
    assert count == 5
    assert {port: b"".join(d for _, d in pieces) for port, pieces in batch} == {0: b"abcaabcaabc", 1: b"bcbc"}


# --- the file ---------------------------------------------------------------------------------------------


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


def test_a_clock_that_is_set_does_not_make_the_record_step(monkeypatch):
    clock = HostClock()
    before = clock.stamp()
    real = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: real() + 3600 * SECOND)
    after = clock.stamp()
    assert 0 <= after.log_ns - before.log_ns < SECOND
    assert after.wall_ns - before.wall_ns == pytest.approx(3600 * SECOND, abs=SECOND)
    assert clock.stepped() == pytest.approx(3600 * SECOND, abs=SECOND)
    assert clock.stepped() == 0


def test_the_live_view_shows_what_comes_and_is_prompt(tmp_path):
    import rerun as rr

    from seatrial.capture.live_view import LiveView
    from seatrial.capture.viewer_process import viewer_command

    path, port = tmp_path / "live.rrd", PortSettings("/dev/a", 115200, Protocol.nmea, "gps")
    recording = rr.RecordingStream("seatrial")
    recording.save(path)
    view = LiveView("trial", (port,), recording)
    decoder = PortDecoder(port, [view.show])
    for i in range(12):
        decoder.feed([(time.time_ns(), nmea_record(i))])
        time.sleep(0.05)
    view.close()
    assert len(view.latency_s) == 12 and view.not_shown == 0
    assert np.median(list(view.latency_s)[6:]) < 0.2
    del recording, view
    assert path.stat().st_size > 5000
    assert viewer_command(9)[3:5] == ["--bind", "127.0.0.1"]
