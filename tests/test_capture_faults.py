"""What can go wrong in a capture: killed at any instant, its clock set, its helpers gone."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from pathlib import Path

import pytest
from capture_samples import capturing, ended, lines_until, raw_bytes

from benchmarks.serial_line import block_of, nmea_record
from ingest import read_log
from ingest.errors import DataError
from seatrial.capture.clocks import HostClock
from seatrial.capture.decoder_process import DecoderProcess
from seatrial.capture.events import Events
from seatrial.capture.playback import recorded_ports
from seatrial.capture.port_reader import PortReader
from seatrial.capture.recovery import recover
from seatrial.capture.session import Session
from seatrial.capture.settings import CaptureSettings, PortSettings, Protocol
from seatrial.cli.capture_lines import Halt

SECOND = 1_000_000_000
CAMPAIGN = """[vessel]
name = "Survey 40"
length = 4.0
beam = 1.6

[inputs.rudder]
kind = "rudder"

[model]
name = "modulus"
"""


@pytest.fixture
def gps(device):
    return device("gps")


def children(pid: int) -> list[int]:
    """Processes that a capture has begun, the oldest first; the tracker of shared memory is none of them."""
    found = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(c) for c in found if b"spawn_main" in Path(f"/proc/{c}/cmdline").read_bytes()]


@pytest.mark.parametrize("instant", [0.03, 0.45, 0.77, 1.3])
def test_killed_at_any_instant_rotating_or_not(gps, tmp_path, instant):
    out = tmp_path / "k.mcap"
    with capturing("--port", gps.link, "--baud", 115200, "--out", out, "--rotate-size", 0.004) as process:
        gps.wait_for_reader()
        sent, began = [], time.monotonic()
        while time.monotonic() < began + instant:
            gps.write(nmea_record(len(sent)))
            sent.append((time.monotonic(), gps.sent))
            time.sleep(0.01)
        killed = time.monotonic()
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    safe = max((total for at, total in sent if at < killed - 0.5), default=0)
    files = sorted(tmp_path.glob("k-*.mcap"))
    kept = b""
    for file in files:
        with contextlib.suppress(DataError):  # a file that was begun at that instant may hold nothing yet
            kept += recorded_ports(recover(file).path)[0].data
    whole = b"".join(nmea_record(i) for i in range(len(sent)))
    assert len(kept) >= safe
    assert whole.startswith(kept)
    assert len(files) > 1 or instant < 1.0


def test_a_clock_that_is_set_is_told_and_the_record_goes_on(gps, tmp_path, monkeypatch):
    port = PortSettings(str(gps.link), 115200, Protocol.nmea, "gps")
    said, stop = [], threading.Event()
    settings = CaptureSettings((port,), tmp_path / "c.mcap", decode=False)
    session = Session(settings, lambda event: said.append(event.line()))
    runner = threading.Thread(target=session.run, args=(stop,))
    runner.start()
    gps.wait_for_reader()
    real = time.time_ns
    for i in range(60):
        if i == 30:
            monkeypatch.setattr(time, "time_ns", lambda: real() - 7_200_000_000_000)
        gps.write(nmea_record(i))
        time.sleep(0.04)
    stop.set()
    runner.join(10.0)
    assert [line for line in said if "clock was set by -7200" in line]
    recorded = recorded_ports(tmp_path / "c.mcap")[0]
    assert recorded.data == b"".join(nmea_record(i) for i in range(60))
    steps = recorded.times[1:] - recorded.times[:-1]
    assert (steps >= 0).all() and steps.max() < 1_000_000_000


def test_decoders_that_die_cost_no_byte(gps, tmp_path):
    out = tmp_path / "d.mcap"
    with capturing("--port", gps.link, "--baud", 115200, "--out", out) as process:
        talking = gps.talk(block_of("nmea", 1 << 14), 4.0)
        lines_until(process, "speaks NMEA")
        os.kill(children(process.pid)[-1], signal.SIGKILL)
        lines_until(process, "the bytes of all ports are still kept")
        talking.join()
        time.sleep(0.3)
        ended(process)
    assert len(raw_bytes(out)["/raw/gps"]) == gps.sent > 20_000


def decoders_of(records: bytes) -> DecoderProcess:
    """Decoders to which a port's records were given as one batch."""
    decoders = DecoderProcess((PortSettings("/dev/none", 115_200, name="gps"),))
    decoders.put([(0, [(0, records)])])
    return decoders


def test_a_signal_in_the_midst_of_a_wait_ends_it():
    """The handler runs in the thread that waits, which may hold the event's own lock at that moment."""
    halt, seen = Halt(), []
    with halt._cond:
        halt.set()
    assert halt.is_set()
    assert halt.wait(0.0) and halt.wait() and halt.is_set()
    other = Halt()
    before = signal.signal(signal.SIGALRM, lambda *_: (seen.append(True), other.set()))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        assert other.wait(60.0) and seen
    finally:
        signal.signal(signal.SIGALRM, before)
    assert not Halt().wait(0.01)


def test_decoders_that_have_little_of_a_busy_machine_are_waited_for():
    records = block_of("nmea", 1 << 14)
    decoders = decoders_of(records)
    os.kill(decoders.pid, signal.SIGSTOP)
    threading.Timer(1.0, os.kill, (decoders.pid, signal.SIGCONT)).start()
    decoders.close(60.0)
    ((index, outcome),) = decoders.take()
    assert (index, outcome.protocol, decoders.undecoded) == (0, Protocol.nmea, 0)


def test_decoders_that_get_next_to_nothing_while_they_still_begin_are_not_given_up():
    decoders = decoders_of(block_of("nmea", 1 << 14))
    done = threading.Event()

    def a_quarter() -> None:
        with contextlib.suppress(ProcessLookupError):
            while not done.is_set():
                os.kill(decoders.pid, signal.SIGSTOP)
                time.sleep(0.15)
                os.kill(decoders.pid, signal.SIGCONT)
                time.sleep(0.05)

    thread = threading.Thread(target=a_quarter)
    thread.start()
    decoders.close(1.0)
    done.set()
    thread.join()
    ((_, outcome),) = decoders.take()
    assert (outcome.protocol, decoders.undecoded) == (Protocol.nmea, 0)


def test_decoders_that_are_stuck_are_not_waited_for_and_what_they_owe_is_counted():
    records = block_of("nmea", 1 << 14)
    decoders = decoders_of(records)
    os.kill(decoders.pid, signal.SIGSTOP)
    decoders.close(0.5)
    assert decoders.undecoded == len(records)
    assert not decoders.take()


def test_an_identification_that_dies_costs_no_byte_and_no_record(gps, tmp_path):
    campaign, out = tmp_path / "campaign.toml", tmp_path / "i.mcap"
    campaign.write_text(CAMPAIGN, encoding="utf-8")
    words = ("--port", gps.link, "--baud", 115200, "--out", out, "--campaign", campaign)
    with capturing(*words) as process:
        talking = gps.talk(block_of("nmea", 1 << 14), 5.0)
        lines_until(process, "speaks NMEA")
        os.kill(children(process.pid)[0], signal.SIGKILL)
        lines_until(process, "the identification has ended unexpectedly")
        talking.join()
        time.sleep(0.3)
        summary, _ = ended(process)
    assert process.returncode == 0
    assert "did not come to its end" in summary
    assert len(raw_bytes(out)["/raw/gps"]) == gps.sent > 20_000
    assert "not decoded" not in summary
    assert len(read_log(out).tables["HDT"]) > 100


@pytest.mark.parametrize(
    ("text", "status", "expected"),
    [
        (CAMPAIGN.replace("modulus", "modulos"), 2, "modulus"),
        (CAMPAIGN.replace("modulus", "nomoto1"), 2, "cannot be identified on line"),
        (None, 2, "is not there"),
    ],
)
def test_a_wrong_campaign_is_said_before_anything_begins(gps, tmp_path, text, status, expected, capsys):
    from seatrial.__main__ import main

    campaign, out = tmp_path / "campaign.toml", tmp_path / "w.mcap"
    if text is not None:
        campaign.write_text(text, encoding="utf-8")
    words = ["--port", str(gps.link), "--baud", "9600", "--out", str(out), "--campaign", str(campaign)]
    with pytest.raises(SystemExit) as exit_:
        main(["capture", *words])
    assert exit_.value.code == status
    assert expected in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


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


def test_a_port_that_stays_away_is_tried_ever_less_often(monkeypatch, tmp_path):
    said, waits, clock = [], [], HostClock()
    reader = PortReader(
        PortSettings(str(tmp_path / "none"), 9600, name="gps"), clock, Events(clock, said.append), 5.0
    )
    monkeypatch.setattr(reader._halt, "wait", lambda s: waits.append(s) or len(waits) == 9)
    reader.run()
    assert waits == [0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0, 5.0]
    assert len(said) == 1 and "cannot be opened" in said[0].text
