"""One thread per port: read what has come, stamp it, hand it on; come back when the device does."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

from seatrial.capture.clocks import HostClock, Stamp
from seatrial.capture.device import Unplugged
from seatrial.capture.events import Events, Level
from seatrial.capture.opening import Port, open_port
from seatrial.capture.priority import run_at_once
from seatrial.capture.settings import PortSettings

#: Pieces shorter than this are followed by a pause, so that slow trickles do not cost a core, bytes and s.
SMALL, PAUSE_S = 512, 0.002
#: How often the errors that the UART counts are looked at, ns.
COUNTED_EVERY_NS = 1_000_000_000
#: The first and the longest wait before a port is opened again, s.
FIRST_WAIT_S, LONGEST_WAIT_S = 0.1, 5.0


class Piece(NamedTuple):
    """Bytes of one read, and when they arrived."""

    stamp: Stamp
    data: bytes


@dataclass
class PortState:
    """What is known of a port; written by its reader alone."""

    bytes: int = 0
    open: bool = False
    unplugged: int = 0
    last_ns: int = 0
    line_errors: dict[str, int] = field(default_factory=dict)


class PortReader(threading.Thread):
    """Reads one port until it is told to stop.

    Attributes
    ----------
    pieces : deque of Piece
        What has arrived and was not taken yet.
    state : PortState
    """

    def __init__(self, settings: PortSettings, clock: HostClock, events: Events, mute_s: float) -> None:
        super().__init__(name=f"read {settings.name}", daemon=True)
        self.settings, self.clock, self.events, self.mute_s = settings, clock, events, mute_s
        self.pieces: deque[Piece] = deque()
        self.state = PortState()
        self._halt = threading.Event()
        self._mute = False
        self._counted_ns = 0
        self._counts: dict[str, int] = {}

    def halt(self) -> None:
        """Ask the thread to end; what the system holds for the port is read first."""
        self._halt.set()

    def take(self) -> list[Piece]:
        """All pieces that have arrived and were not taken yet."""
        return [self.pieces.popleft() for _ in range(len(self.pieces))]

    def run(self) -> None:
        """Open, read, open again, with longer and longer waits."""
        run_at_once()
        wait, said = FIRST_WAIT_S, ""
        while True:
            try:
                device = open_port(self.settings)
            except Unplugged as error:
                if str(error) != said:
                    said = str(error)
                    self._tell(f"cannot be opened ({said}); trying again", Level.warning)
                if self._halt.wait(wait):
                    return
                wait = min(2 * wait, LONGEST_WAIT_S)
                continue
            if self.state.unplugged or said:
                self._tell("is back")
            wait, said = FIRST_WAIT_S, ""
            if self._session(device):
                return

    def _session(self, device: Port) -> bool:
        """Read until told to stop (True) or the device is gone (False)."""
        self.state.open = True
        self.state.last_ns = self._counted_ns = self.clock.stamp().log_ns
        self._counts = device.line_errors()
        try:
            while not self._halt.is_set():
                self._read(device)
            self._drain(device)
            return True
        except Unplugged as error:
            self.state.unplugged += 1
            self._tell(f"unplugged ({error}); waiting for it", Level.warning)
            return self._halt.is_set()
        finally:
            self.state.open = False
            device.close()

    def _read(self, device: Port) -> None:
        data = device.read()
        stamp = self.clock.stamp()
        if stamp.log_ns - self._counted_ns > COUNTED_EVERY_NS:
            self._counted_ns = stamp.log_ns
            self._count_line_errors(device)
        if not data:
            self._listen(stamp)
            return
        self._keep(stamp, data)
        if len(data) < SMALL:
            self._halt.wait(PAUSE_S)

    def _keep(self, stamp: Stamp, data: bytes) -> None:
        self.pieces.append(Piece(stamp, data))
        self.state.bytes += len(data)
        if self._mute:
            self._mute = False
            silence = (stamp.log_ns - self.state.last_ns) * 1e-9
            self._tell(f"speaks again after {silence:.0f} s")
        self.state.last_ns = stamp.log_ns

    def _drain(self, device: Port) -> None:
        """Take what the system still holds, without waiting for more than one read's time."""
        while data := device.read():
            self._keep(self.clock.stamp(), data)
            if len(data) < SMALL:
                return

    def _count_line_errors(self, device: Port) -> None:
        """Say what the UART has counted since the last look: overruns are bytes that are lost."""
        counts = device.line_errors()
        new = {k: n - self._counts.get(k, 0) for k, n in counts.items() if n > self._counts.get(k, 0)}
        self._counts = counts
        if new and not self.state.line_errors:
            hint = "; is the baud rate right?" if "framing errors" in new else ""
            said = ", ".join(f"{n} {kind}" for kind, n in new.items())
            self._tell(f"the port counts {said}{hint}", Level.warning)
        for kind, n in new.items():
            self.state.line_errors[kind] = self.state.line_errors.get(kind, 0) + n

    def _listen(self, stamp: Stamp) -> None:
        """Nothing has come: say so, once, when it has been too long."""
        silence = (stamp.log_ns - self.state.last_ns) * 1e-9
        if silence > self.mute_s and not self._mute:
            self._mute = True
            never = "" if self.state.bytes else " yet; is it switched on, and wired to this port?"
            self._tell(f"mute: no byte for {silence:.0f} s{never}", Level.warning)

    def _tell(self, text: str, level: Level = Level.info) -> None:
        self.events.tell(self.settings.name, text, level)
