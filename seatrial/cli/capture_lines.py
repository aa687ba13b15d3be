"""What ``seatrial capture`` says while it runs, and how it is told to end."""

from __future__ import annotations

import signal
import threading
from datetime import UTC, datetime
from queue import Empty, SimpleQueue
from types import FrameType
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from seatrial.capture.events import Event

COLOURS = {3: "yellow", 4: "red"}


class Teller:
    """Writes events to stderr, a line each."""

    def __init__(self, quiet: bool) -> None:
        self.quiet = quiet

    def __call__(self, event: Event) -> None:
        """Write one event; where it is quiet, only what is wrong."""
        colour = COLOURS.get(event.level)
        if colour is None and self.quiet:
            return
        time = datetime.fromtimestamp(event.stamp.wall_ns * 1e-9, UTC).strftime("%H:%M:%S")
        typer.echo(typer.style(f"{time} {event.line()}", fg=colour), err=True)


class Halt(threading.Event):
    """An event that a signal's handler may set while the thread that it interrupts is waiting for it.

    A plain one has a lock that the interrupted wait may hold: the handler would then wait for it for ever. To put
    something into a ``SimpleQueue`` takes none.
    """

    def __init__(self) -> None:
        super().__init__()
        self._told: SimpleQueue[None] = SimpleQueue()

    def set(self) -> None:
        """End every wait; from a signal's handler, too."""
        self._told.put(None)

    def is_set(self) -> bool:
        """Whether it has been set."""
        return super().is_set() or not self._told.empty()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set, for so many s at most; whether it is."""
        if super().is_set():
            return True
        try:
            self._told.get(timeout=None if timeout is None else max(timeout, 0.0))
        except Empty:
            return False
        super().set()
        return True


def stop_on_signals() -> threading.Event:
    """An event that is set by the first signal to end; the second one is not held back."""
    stop = Halt()

    def halt(number: int, frame: FrameType | None) -> None:
        stop.set()
        signal.signal(number, signal.SIG_DFL)

    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), halt)
    return stop
