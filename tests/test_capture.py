"""Live capture against real pseudo terminals and real processes, killed for real."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from capture_samples import SCRIPT, capturing, ended, lines_until, raw_bytes, read_findings

from benchmarks.serial_line import block_of, nmea, nmea_record
from ingest import read_log
from ingest.ros.records import Contents
from seatrial.capture.playback import recorded_ports
from seatrial.capture.recording_file import Message, RecordingFile
from seatrial.capture.records import ChannelSpec
from seatrial.capture.recovery import mapped, messages

SECOND = 1_000_000_000
NOISE = np.random.default_rng(1).integers(0, 256, 200_000, np.uint8).tobytes()
RAW = ChannelSpec("/raw/gps", "raw", metadata=(("protocol", "nmea"), ("baud", "115200")))


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
        assert kept[f"/raw/{name}"] == bytes(line.taken)
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


@contextlib.contextmanager
def on_a_full_disk(line, out):
    """A capture on whose disk there is room for 60 kB, when more than that has come."""
    words = ("--port", line.link, "--baud", 921600, "--out", out, "--no-decode")
    with capturing(*words, limit=60_000) as process:
        line.talk(NOISE, 1.5, 921_600).join()
        lines_until(process, "nothing can be written")
        yield process


def test_a_full_disk_is_said_and_the_file_is_still_good(device, tmp_path):
    line, out = device("gps"), tmp_path / "full.mcap"
    with on_a_full_disk(line, out) as process:
        _, said = ended(process)
    assert process.returncode == 1
    assert "could not be written" in said
    kept = raw_bytes(out)["/raw/gps"]
    assert 20_000 < len(kept) < 60_000
    assert line.taken.startswith(kept)


def test_a_disk_that_has_room_again_gets_all_that_was_held(device, tmp_path):
    line, out = device("gps"), tmp_path / "full.mcap"
    with on_a_full_disk(line, out) as process:
        _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (most, most))
        lines_until(process, "writing again; what was held is in the file")
        ended(process)
    assert process.returncode == 0
    assert raw_bytes(out)["/raw/gps"] == bytes(line.taken)
    assert not read_findings(out)


def test_files_rotate_and_nothing_is_between_them(device, tmp_path):
    line = device("gps")
    options = ("--rotate-size", 0.03, "--no-decode", "--duration", 3)
    with capturing("--port", line.link, "--baud", 921600, "--out", tmp_path / "t.mcap", *options) as process:
        line.talk(NOISE, 1.2, 921_600).join()
        ended(process, None)
    files = sorted(tmp_path.glob("t-*.mcap"))
    assert len(files) >= 3
    assert files[0].name == "t-001.mcap"
    assert not any(read_findings(f) for f in files)
    parts = [
        m.payload for f in files for m in messages(mapped(f), Contents()) if m.channel.topic == "/raw/gps"
    ]
    assert b"".join(parts) == bytes(line.taken)


def test_files_rotate_by_time(device, tmp_path):
    line = device("gps")
    options = ("--rotate-minutes", 0.01, "--no-decode", "--duration", 3)
    with capturing("--port", line.link, "--baud", 115200, "--out", tmp_path / "t.mcap", *options) as process:
        line.talk(block_of("nmea", 1 << 15), 2.0).join()
        ended(process, None)
    files = sorted(tmp_path.glob("t-*.mcap"))
    parts = [[m for m in messages(mapped(f), Contents()) if m.channel.topic == "/raw/gps"] for f in files]
    assert len(files) >= 3
    assert all(p[-1].log_ns - p[0].log_ns < 2 * SECOND for p in parts if p)
    assert b"".join(m.payload for p in parts for m in p) == bytes(line.taken)


def test_an_autopilot_hears_a_heartbeat_only_where_that_is_asked_for(device, tmp_path):
    from pymavlink.dialects.v20 import common

    told, quiet = device("told"), device("quiet")
    config = tmp_path / "capture.toml"
    port = '[[port]]\ndevice = "{}"\nbaud = 57600\nprotocol = "mavlink"\n'
    config.write_text(
        'out = "a.mcap"\n' + port.format(told.link) + "heartbeat = true\n" + port.format(quiet.link),
        encoding="utf-8",
    )
    with capturing(config) as process:
        talking = [line.talk(block_of("mavlink", 1 << 14), 2.2) for line in (told, quiet)]
        for thread in talking:
            thread.join()
        ended(process)
    assert quiet.received() == b""
    heard = common.MAVLink(None).parse_buffer(told.received())
    assert 2 <= len(heard) <= 5
    assert {(m.get_type(), m.get_srcSystem(), m.type) for m in heard} == {("HEARTBEAT", 255, 6)}
    assert [m.get_seq() for m in heard] == list(range(len(heard)))
    assert raw_bytes(tmp_path / "a.mcap")["/raw/told"]


def test_a_device_that_never_speaks_is_status_one(device, tmp_path):
    line = device("gps")
    options = ("--duration", 0.5, "--no-decode")
    with capturing("--port", line.link, "--baud", 9600, "--out", tmp_path / "a.mcap", *options) as process:
        out, err = ended(process, None)
    assert process.returncode == 1
    assert "no byte came" in out and "no byte came from any port" in err


IN_TURN = "import os; os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))"


@pytest.mark.skipif(
    subprocess.run([sys.executable, "-c", IN_TURN], capture_output=True, check=False).returncode != 0,
    reason="may ask for no turn before others here",
)
def test_what_plays_back_is_not_held_up_by_other_work(tmp_path):
    out, link = tmp_path / "a.mcap", tmp_path / "port"
    file = RecordingFile(out)
    file.append([Message(RAW, SECOND * 1_700_000_000 + i * SECOND, 0, nmea_record(i)) for i in range(30)])
    file.finish()
    player = subprocess.Popen([SCRIPT, "replay", out, "--port", link, "--no-wait"], stdout=subprocess.DEVNULL)
    end = time.monotonic() + 20.0
    while (policy := os.sched_getscheduler(player.pid)) == os.SCHED_OTHER and time.monotonic() < end:
        time.sleep(0.05)
    player.terminate()
    player.wait()
    assert policy & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR


def test_played_back_it_is_captured_again(tmp_path):
    out, link = tmp_path / "a.mcap", tmp_path / "port"
    file = RecordingFile(out)
    pieces = [nmea_record(i) for i in range(30)]  # no more than the line holds: a late reader has them all
    file.append([Message(RAW, SECOND * 1_700_000_000 + i * SECOND // 30, 0, p) for i, p in enumerate(pieces)])
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
