"""What ``seatrial capture`` says while it runs, and how it is told to end."""

from __future__ import annotations

import signal
import threading
from datetime import UTC, datetime
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


def stop_on_signals() -> threading.Event:
    """An event that is set by the first signal to end; the second one is not held back."""
    stop = threading.Event()

    def halt(number: int, frame: FrameType | None) -> None:
        stop.set()
        signal.signal(number, signal.SIG_DFL)

    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), halt)
    return stop
