"""A capture as a process of its own, and devices that talk to it."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from benchmarks.serial_line import SerialLine, pace
from ingest.ros.records import Contents
from seatrial.capture.playback import recorded_ports
from seatrial.capture.recovery import mapped, messages

SCRIPT = Path(sys.executable).parent / "seatrial"


class Device(SerialLine):
    """A device that a thread keeps talking, and that knows what the line took: a late reader makes it refuse some."""

    def __post_init__(self) -> None:
        self.taken = bytearray()
        super().__post_init__()

    def write(self, data: bytes) -> int:
        done = super().write(data)
        self.taken += data[:done]
        return done

    def talk(self, block: bytes, seconds: float, baud: int = 115_200) -> threading.Thread:
        def go() -> None:
            self.wait_for_reader()
            pace(self, block, baud, seconds)

        thread = threading.Thread(target=go, daemon=True)
        thread.start()
        return thread


@contextlib.contextmanager
def capturing(*words: object, limit: int | None = None):
    """A capture in a process group of its own."""

    def prepare() -> None:
        os.setsid()
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))

    process = subprocess.Popen(
        [SCRIPT, "capture", *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=prepare,
    )
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def ended(process: subprocess.Popen[str], by: int | None = signal.SIGINT) -> tuple[str, str]:
    if by is not None:
        process.send_signal(by)
    out, err = process.communicate(timeout=120)
    assert "Traceback" not in err, err
    return out, err


def raw_bytes(path: Path) -> dict[str, bytes]:
    return {p.topic: p.data for p in recorded_ports(path)}


def read_findings(path: Path) -> list[str]:
    contents = Contents()
    list(messages(mapped(path), contents))
    return [f.message for f in contents.findings]


def lines_until(process: subprocess.Popen[str], words: str, patience_s: float = 60.0) -> str:
    """Stderr up to the line with these words."""
    said, end = "", time.monotonic() + patience_s
    while words not in said:
        assert time.monotonic() < end, said
        said += process.stderr.readline()
    return said
