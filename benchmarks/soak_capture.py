"""Capture from four ports at 921,600 baud at once, and check that every byte is in the file.

    python -m benchmarks.soak_capture --seconds 600

Each device is a process of its own that writes at the line's own pace without ever waiting, and counts what was
refused because the capture was late. Prints bytes lost, processor time per port, and the latency of the live view.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from seatrial.capture.decoder_process import cpu_seconds
from seatrial.capture.playback import recorded_ports

PROTOCOLS = ("nmea", "ubx", "mavlink", "mixed")
BAUD = 921_600


def devices(folder: Path, seconds: float) -> list[subprocess.Popen[str]]:
    """The generators, one process each."""
    command = [sys.executable, "-m", "benchmarks.serial_line"]
    started = [
        subprocess.Popen(
            [*command, str(folder / p), "--baud", str(BAUD), "--protocol", p, "--seconds", str(seconds)],
            stdout=subprocess.PIPE,
            text=True,
        )
        for p in PROTOCOLS
    ]
    while not all((folder / p).is_symlink() for p in PROTOCOLS):
        time.sleep(0.05)
    return started


def capture(folder: Path, live: bool) -> subprocess.Popen[str]:
    """The capture of all devices."""
    ports = [word for p in PROTOCOLS for word in ("--port", str(folder / p))]
    command = [sys.executable, "-m", "seatrial", "capture", *ports, "--baud", str(BAUD)]
    return subprocess.Popen(
        [*command, "--out", str(folder / "soak.mcap"), *(["--live"] if live else [])],
        stdout=subprocess.PIPE,
        text=True,
    )


def family(pid: int) -> list[int]:
    """A process and its descendants, but for the viewer."""
    children = Path(f"/proc/{pid}/task/{pid}/children")
    below = [int(c) for c in children.read_text().split()] if children.exists() else []
    kept = [c for c in below if b"rerun" not in Path(f"/proc/{c}/cmdline").read_bytes()]
    return [pid, *(g for c in kept for g in family(c))]


class Meter(threading.Thread):
    """Adds up the processor time of a process and its family."""

    def __init__(self, pid: int) -> None:
        super().__init__(daemon=True)
        self.pid = pid
        self.seconds: dict[int, float] = {}
        self.first: dict[int, float] = {}
        self.peak_mb = 0.0

    def run(self) -> None:
        """Look once a second, as long as the process is there."""
        while Path(f"/proc/{self.pid}").exists():
            for pid in family(self.pid):
                used = cpu_seconds(pid)
                if used == used:
                    self.first.setdefault(pid, used)
                    self.seconds[pid] = used
            self.peak_mb = max(self.peak_mb, resident_mb(list(self.seconds)))
            time.sleep(1.0)


def resident_mb(pids: list[int]) -> float:
    """Memory of processes, MB."""
    total = 0
    for pid in pids:
        status = Path(f"/proc/{pid}/statm")
        total += int(status.read_text().split()[1]) * 4096 if status.exists() else 0
    return total / 1e6


def main() -> None:
    """Run, and print the result; status 1 where a byte is missing."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--live", action="store_true", help="with the live view, to measure its latency")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        generators = devices(folder, options.seconds)
        process = capture(folder, options.live)
        meter = Meter(process.pid)
        meter.start()
        told = [json.loads(g.communicate()[0]) for g in generators]
        process.send_signal(signal.SIGINT)
        summary = process.communicate()[0]
        print(summary)
        ok = report(folder / "soak.mcap", told, meter, options.seconds)
    raise SystemExit(0 if ok and process.returncode == 0 else 1)


def report(path: Path, told: list[dict[str, int | float | str]], meter: Meter, seconds: float) -> bool:
    """Print what was lost and what it cost; whether nothing was lost."""
    kept = {p.topic: p.data for p in recorded_ports(path)}
    whole = True
    for one in told:
        data = kept.get(f"/raw/{Path(str(one['link'])).name}", b"")
        same = hashlib.sha256(data).hexdigest() == one["digest"]
        whole &= same and not one["refused"] and not one["talked_to"]
        lost = int(one["sent"]) - len(data)
        print(
            f"{Path(str(one['link'])).name}: sent {one['sent']:,}, refused {one['refused']:,}, lost {lost:,}, "
            f"{'identical' if same else 'NOT IDENTICAL'}, sent to the device {one['talked_to']}, "
            f"generator held up {one['held_up_s']} s"
        )
    used = sum(meter.seconds.values()) / seconds
    print(
        f"processor: {used:.0%} of one core, {used / len(told):.1%} per port, start included; "
        f"memory {meter.peak_mb:.0f} MB"
    )
    return whole


if __name__ == "__main__":
    main()
