"""The Rerun viewer of a capture: a window where there is a screen, else a server for a browser."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass

MEMORY = "1GB"


@dataclass(frozen=True)
class Viewer:
    """A viewer that only this machine can reach.

    Attributes
    ----------
    address : int
        Port that it listens on.
    """

    address: int
    _process: subprocess.Popen[bytes]
    _serves: bool

    @classmethod
    def start(cls) -> Viewer:
        """Begin one; it takes some seconds until it listens."""
        address = free_port()
        command = viewer_command(address)
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        return cls(address, process, "--web-viewer" in command)

    def close(self) -> None:
        """End a server for a browser; a window stays open."""
        if self._serves:
            with suppress(OSError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()


def viewer_command(port: int) -> list[str]:
    """The command that opens an empty viewer: a window where there is a screen, else the browser."""
    screen = sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    where = ["--hide-welcome-screen"] if screen else ["--web-viewer", "--web-viewer-port", "0"]
    return [
        sys.executable,
        "-m",
        "rerun",
        "--bind",
        "127.0.0.1",
        "--port",
        str(port),
        "--memory-limit",
        MEMORY,
        "--server-memory-limit",
        MEMORY,
        *where,
    ]


def free_port() -> int:
    """A port of this machine that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for(port: int, patience_s: float = 10.0) -> None:
    """Wait until the viewer listens, or has had time enough."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
