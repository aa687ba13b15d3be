"""The identification in a process of its own, fed by the decoders: whatever it does, no byte waits for it."""

from __future__ import annotations

import signal
import threading
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

from ingest.errors import SeatrialError
from seatrial.capture.decoder_process import endings_blocked
from seatrial.capture.decoders import Tables
from seatrial.capture.priority import LAST, run_at_once, set_niceness
from seatrial.online.updates import Note, Update

Batch = tuple[str, Tables]
Timed = tuple[int, Update]


@dataclass(frozen=True)
class OnlineWanted:
    """What is to be identified, and where its results go.

    Attributes
    ----------
    campaign : Path
    state : Path, optional
        Where the state is read from, if it is there, and kept.
    forget_s : float
        Time constant of forgetting.
    model : Path, optional
        Where the model is written at the end.
    viewer : tuple of (address, name, recording id), optional
        Of the live view.
    """

    campaign: Path
    state: Path | None = None
    forget_s: float = float("inf")
    model: Path | None = None
    viewer: tuple[int, str, str] | None = None


@dataclass(frozen=True)
class Ending:
    """Lines for the person when all is over."""

    lines: tuple[str, ...]


def serve(inbox: Connection, outbox: Connection, wanted: OnlineWanted) -> None:
    """Identify until the decoders have no more: the main function of the process."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    set_niceness(LAST)
    from seatrial.online.running import Running

    try:
        running = Running(wanted)
        for port, tables in batches_from(inbox, running):
            outbox.send(running.feed(port, tables))
        outbox.send(running.finish())
        outbox.send(Ending(running.lines()))
    except SeatrialError as error:
        outbox.send([(0, Note(0.0, f"cannot go on: {error}", warning=True))])
        outbox.send(Ending((f"on line: {error}",)))
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, AssertionError) as error:
        failed = f"the identification has failed ({type(error).__name__}: {error})"
        outbox.send([(0, Note(0.0, f"{failed}; the capture goes on", warning=True))])
        outbox.send(Ending((f"on line: {failed}",)))
    except (EOFError, OSError):
        return
    outbox.send(None)


def batches_from(inbox: Connection, running: object) -> Iterable[Batch]:
    """Batches until the decoders say that it was all, or are gone."""
    while True:
        try:
            batch = inbox.recv()
        except (EOFError, OSError):
            return
        if isinstance(batch, int):
            running.left_out = batch  # type: ignore[attr-defined]
            return
        yield batch


class OnlineProcess:
    """Starts the identification and collects what it says.

    Attributes
    ----------
    feed : Connection
        The end that the decoders write to.
    ending : Ending, optional
        When it is over.
    failed : bool
        Whether it has ended before its time.
    """

    def __init__(self, wanted: OnlineWanted) -> None:
        context = get_context("spawn")
        inbox, self.feed = context.Pipe(duplex=False)
        self._outcomes, outbox = context.Pipe(duplex=False)
        self.ending: Ending | None = None
        self.failed = False
        self._updates: deque[Timed] = deque()
        self._finished = threading.Event()
        self._process = context.Process(
            target=serve, args=(inbox, outbox, wanted), daemon=True, name="seatrial online"
        )
        with endings_blocked():
            self._process.start()
        inbox.close()
        outbox.close()
        threading.Thread(target=self._receive, daemon=True).start()

    def take(self) -> list[Timed]:
        """Updates since the last call, with their times, ns."""
        return [self._updates.popleft() for _ in range(len(self._updates))]

    def close(self, patience_s: float) -> None:
        """Let it finish, but not for longer than this."""
        self.feed.close()
        if not self._finished.wait(patience_s):
            self._process.kill()
        self._process.join(1.0)

    def _receive(self) -> None:
        run_at_once()
        try:
            while (outcome := self._outcomes.recv()) is not None:
                if isinstance(outcome, Ending):
                    self.ending = outcome
                else:
                    self._updates.extend(outcome)
        except (EOFError, OSError):
            self.failed = True
        self._finished.set()
