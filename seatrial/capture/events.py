"""What happens during a capture, for the person and for the file."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum

from seatrial.capture.clocks import HostClock, Stamp


class Level(IntEnum):
    """How bad it is; the numbers are those of Foxglove's log messages."""

    info = 2
    warning = 3
    error = 4


@dataclass(frozen=True)
class Event:
    """One clear line: when, about which port (empty: the capture itself), how bad, what."""

    stamp: Stamp
    port: str
    level: Level
    text: str

    def line(self) -> str:
        """As a person reads it."""
        return f"{self.port}: {self.text}" if self.port else self.text


@dataclass
class Events:
    """Collects events from all threads and tells them to a listener."""

    clock: HostClock
    listener: Callable[[Event], None]
    pending: deque[Event] = field(default_factory=deque)

    def tell(self, port: str, text: str, level: Level = Level.info) -> None:
        """Tell the listener, and keep it for the file."""
        event = Event(self.clock.stamp(), port, level, text)
        self.pending.append(event)
        self.listener(event)
