"""CAN interfaces: an SLCAN adapter that is played over a pseudo terminal, and interfaces of python-can."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import threading
import time
from pathlib import Path

import can
import numpy as np
import pandas as pd
import pytest
from capture_samples import capturing, ended, raw_bytes

from benchmarks.serial_line import SerialLine, slcan_record
from ingest import read_log
from ingest.errors import UsageError
from seatrial.capture.can_adapter import SlcanDecoder
from seatrial.capture.can_device import NETWORK, CanInterface, check_interface, interface_of, line_of
from seatrial.capture.device import Unplugged
from seatrial.capture.opening import open_port
from seatrial.capture.session import Session
from seatrial.capture.settings import CaptureSettings, PortSettings, Protocol
from seatrial.capture.settings_file import Wanted, settings_from


class Adapter(SerialLine):
    """An SLCAN adapter: answers commands, and passes frames on once it has been told to listen."""

    def serve(self, frames: list[bytes], stop: threading.Event) -> None:
        self.told = b""
        sent = 0
        while not stop.wait(0.005):
            with contextlib.suppress(OSError):
                heard = os.read(self.master, 4096)
                self.told += heard
                self.write(b"\r" * heard.count(b"\r"))
            listening = self.told.rfind(b"L\r") > self.told.rfind(b"C\r")
            if listening and sent < len(frames):
                self.write(frames[sent])
                sent += 1


def test_an_slcan_adapter_is_told_to_listen_and_nothing_else(tmp_path):
    adapter, stop, out = Adapter(tmp_path / "adapter"), threading.Event(), tmp_path / "bus.mcap"
    frames = [slcan_record(i) for i in range(120)]
    server = threading.Thread(target=adapter.serve, args=(frames, stop), daemon=True)
    server.start()
    words = ("--port", adapter.link, "--baud", 115200, "--protocol", "slcan", "--bitrate", 500_000)
    with capturing(*words, "--out", out) as process:
        end = time.monotonic() + 15.0
        while adapter.sent < sum(map(len, frames)) and time.monotonic() < end:
            time.sleep(0.05)
        time.sleep(0.4)
        ended(process)
    stop.set()
    server.join()
    os.close(adapter.master)
    assert process.returncode == 0
    commands = [c for c in adapter.told.split(b"\r") if c.strip()]
    assert commands[-1] == b"C" and b"S6" in commands and b"L" in commands
    assert not {c[:1] for c in commands} & {b"O", b"t", b"T", b"r", b"R"}
    assert b"".join(frames) in raw_bytes(out)["/raw/adapter"]
    assert len(read_log(out).tables["vesselHeading"]) == len(frames)


def test_an_adapter_that_is_not_there_is_unplugged(tmp_path):
    with pytest.raises(Unplugged):
        open_port(PortSettings(str(tmp_path / "none"), 115200, Protocol.slcan, "a"))


def test_frames_of_any_interface_become_lines_that_the_decoder_reads():
    port = open_port(PortSettings("virtual:seatrial-test", 0, Protocol.slcan, "bus"))
    assert isinstance(port, CanInterface)
    with can.Bus(channel="seatrial-test", interface="virtual") as sender:
        for i in range(30):
            data = bytes.fromhex(slcan_record(i)[10:26].decode())
            sender.send(can.Message(arbitration_id=0x09F11224, is_extended_id=True, data=data))
        found = b"".join(iter(port.read, b""))
    port.close()
    assert found == b"".join(slcan_record(i) for i in range(30))
    tables = SlcanDecoder().feed([(time.time_ns(), found)]).tables
    assert len(tables["vesselHeading"]) == 30
    assert np.all(np.diff(tables["vesselHeading"]["heading"]) > 0)


def test_an_interface_is_captured_from_its_frames_to_the_log(tmp_path):
    """All but the driver is what SocketCAN goes through: python-can's own bus within this process."""
    (port,) = settings_from(Wanted(None, ["virtual:seatrial-session"])).ports
    said, stop, out = [], threading.Event(), tmp_path / "bus.mcap"
    session = Session(CaptureSettings((port,), out), lambda event: said.append(event.line()))
    found = []
    runner = threading.Thread(target=lambda: found.append(session.run(stop)))
    runner.start()
    with can.Bus(channel="seatrial-session", interface="virtual") as sender:
        time.sleep(0.5)
        for i in range(50):
            data = bytes.fromhex(slcan_record(i)[10:26].decode())
            sender.send(can.Message(arbitration_id=0x09F11224, is_extended_id=True, data=data))
            sender.send(can.Message(is_error_frame=True))
        time.sleep(0.5)
    stop.set()
    runner.join(30.0)
    (summary,) = found
    assert not summary.faults and summary.ports[0].records == 50
    assert raw_bytes(out) == {f"/raw/{port.name}": b"".join(slcan_record(i) for i in range(50))}
    log = read_log(out)
    assert len(log.tables["vesselHeading"]) == 50
    assert {s.quantity for s in log.sources} >= {"heading"}


def test_two_engines_of_one_device_stay_apart_though_their_records_come_alone():
    def engine(i: int, number: int) -> bytes:
        payload = struct.pack("<BHHb2x", number, 4 * (600 + 10 * i + 500 * number), 0xFFFF, 0x7F)
        return b"T09F20011" + b"8" + payload.hex().upper().encode() + b"\r"

    decoder, tables, sources = SlcanDecoder(), {}, ()
    for i in range(40):
        found = decoder.feed([(10**9 + i * 10**8, engine(i, i % 2))])
        sources = found.sources
        for topic, table in found.tables.items():
            tables.setdefault(topic, []).append(table)
    joined = {t: pd.concat(parts) for t, parts in tables.items()}
    name = "engineParametersRapidUpdate"
    assert set(joined) == {name, f"{name}[0]", f"{name}[1]"}
    np.testing.assert_allclose(joined[f"{name}[1]"]["speed"], 1100 + 10 * np.arange(1, 40, 2))
    assert len(joined[f"{name}[0]"]) == 19  # all but the first: then there was only one
    assert {s.topic for s in sources if s.quantity == "propeller"} == {f"{name}[0]", f"{name}[1]"}


@pytest.mark.parametrize(
    ("message", "line"),
    [
        (can.Message(arbitration_id=0x123, is_extended_id=False, data=b"\x01\xab"), b"t123201AB\r"),
        (can.Message(arbitration_id=0x123, is_extended_id=True, data=b""), b"T000001230\r"),
        (can.Message(arbitration_id=0x7, is_extended_id=False, is_remote_frame=True, dlc=4), b"r0074\r"),
        (can.Message(is_error_frame=True), b""),
        (can.Message(is_fd=True, data=b"\0" * 12), b""),
    ],
)
def test_a_frame_as_a_line(message, line):
    assert line_of(message) == line


@pytest.mark.parametrize(
    ("device", "interface"),
    [
        ("can0", ("socketcan", "can0")),
        ("vcan12", ("socketcan", "vcan12")),
        ("socketcan:can1", ("socketcan", "can1")),
        ("pcan:PCAN_USBBUS1", ("pcan", "PCAN_USBBUS1")),
        ("/dev/ttyUSB0", None),
        ("COM7", None),
        ("C:\\port", None),
    ],
)
def test_which_names_are_interfaces(device, interface):
    assert interface_of(device) == interface


def test_an_interface_needs_no_line_rate_and_speaks_slcan(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (port,) = settings_from(Wanted(None, ["can0"])).ports
    assert (port.protocol, port.bitrate, port.name) == (Protocol.slcan, 250_000, "can0")
    Path("capture.toml").write_text('[[port]]\ndevice = "can1"\nbitrate = 500000\n', encoding="utf-8")
    (port,) = settings_from(Wanted(Path("capture.toml"))).ports
    assert (port.protocol, port.bitrate) == (Protocol.slcan, 500_000)


def has_socketcan() -> bool:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except (OSError, AttributeError):
        return False
    return True


def test_what_is_missing_is_said(capsys, tmp_path):
    from seatrial.__main__ import main

    with pytest.raises(UsageError, match="Did you mean 'socketcan'"):
        check_interface("soketcan", "can0")
    with pytest.raises(SystemExit) as exit_:
        main(["capture", "--port", "can97", "--out", str(tmp_path / "a.mcap")])
    assert exit_.value.code == 2
    said = " ".join(capsys.readouterr().err.split())
    assert ("no such CAN interface" if has_socketcan() else "no SocketCAN") in said
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not (NETWORK / "vcan0").exists(), reason="there is no virtual CAN interface vcan0 here")
def test_socketcan(tmp_path):
    out = tmp_path / "bus.mcap"
    with capturing("--port", "vcan0", "--out", out) as process:
        time.sleep(2.0)
        with can.Bus(channel="vcan0", interface="socketcan") as sender:
            for i in range(50):
                data = bytes.fromhex(slcan_record(i)[10:26].decode())
                sender.send(can.Message(arbitration_id=0x09F11224, is_extended_id=True, data=data))
        time.sleep(1.0)
        ended(process)
    assert raw_bytes(out)["/raw/vcan0"] == b"".join(slcan_record(i) for i in range(50))
