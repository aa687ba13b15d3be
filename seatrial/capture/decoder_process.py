"""The decoders in a process of their own, so that whatever they do, no byte waits for them."""

from __future__ import annotations

import os
import signal
import threading
from collections import defaultdict, deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

from seatrial.capture.live_decoding import Outcome, PortDecoder
from seatrial.capture.online_link import OnlineLink
from seatrial.capture.priority import PATIENT, WATCHED, run_at_once, set_niceness
from seatrial.capture.settings import PortSettings
from seatrial.capture.warm_decoders import warm_up

if TYPE_CHECKING:
    from seatrial.capture.live_view import LiveView

#: Bytes that may wait for the decoders; what comes on top is kept but not decoded.
MOST_WAITING = 1 << 26
#: Signals that end a capture: they are for its main process.
ENDINGS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))

#: Bytes beyond which waiting batches are not taken together: what they give comes back in one piece, and while it is
#: unpacked no byte is read.
MOST_AT_ONCE = 1 << 17
#: How often at most decoders that get little processor time may say nothing for as long as the patience lasts.
MOST_SILENCES = 60

Batch = list[tuple[int, list[tuple[int, bytes]]]]


@dataclass(frozen=True)
class LiveWanted:
    """That the decoded data are to be shown.

    Attributes
    ----------
    name : str
        Of the capture.
    address : int
        Port of this machine that the viewer is to listen on.
    recording_id : str
    online : bool
        Whether an identification is shown beside them.
    """

    name: str
    address: int
    recording_id: str
    online: bool = False


@dataclass(frozen=True)
class LiveStats:
    """How the live view did.

    Attributes
    ----------
    latency_s : tuple of float
        From arrival to the viewer: median, 99th percentile, worst; NaN where nothing was shown.
    not_shown : int
        Batches that were dropped because the viewer was behind.
    """

    latency_s: tuple[float, float, float]
    not_shown: int


def serve(
    connection: Connection,
    ports: tuple[PortSettings, ...],
    live: LiveWanted | None,
    online: Connection | None,
) -> None:
    """Decode batches until the other end closes: the main function of the process."""
    set_niceness(PATIENT if live is None else WATCHED)
    warm_up(ports)
    view = _view(live, ports)
    link = None if online is None else OnlineLink(online)
    watchers = [w.show for w in (view, link) if w is not None]
    decoders = [PortDecoder(port, watchers) for port in ports]
    try:
        for count, batch in Inbox(connection):
            connection.send((count, [(index, _fed(decoders[index], pieces)) for index, pieces in batch]))
        if link is not None:
            link.close()
        if view is not None:
            view.close()
            connection.send(LiveStats(view.latencies_s(), view.not_shown))
        connection.send(None)
    except (EOFError, OSError):
        if view is not None:
            view.close()


def _view(live: LiveWanted | None, ports: tuple[PortSettings, ...]) -> LiveView | None:
    if live is None:
        return None
    from seatrial.capture.live_view import LiveView

    return LiveView.open(live, ports)


class Inbox:
    """The batches that come: who is behind gets several as one, which is cheaper to decode."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._ended = False

    def __iter__(self) -> Iterator[tuple[int, Batch]]:
        """How many batches waited, and all of them together, until the end is sent."""
        while not self._ended:
            count, pieces = self._waiting()
            if count:
                yield count, list(pieces.items())

    def _waiting(self) -> tuple[int, dict[int, list[tuple[int, bytes]]]]:
        pieces: dict[int, list[tuple[int, bytes]]] = defaultdict(list)
        count = size = 0
        while True:
            batch: Batch | None = self._connection.recv()
            if batch is None:
                self._ended = True
                return count, pieces
            count, size = count + 1, size + _size(batch)
            for index, more in batch:
                pieces[index] += more
            if size > MOST_AT_ONCE or not self._connection.poll():
                return count, pieces


def _fed(decoder: PortDecoder, pieces: list[tuple[int, bytes]]) -> Outcome:
    """Decode; an error of a decoder costs the batch, and is told."""
    try:
        return decoder.feed(pieces)
    except (ArithmeticError, LookupError, TypeError, ValueError, AssertionError) as error:
        return Outcome(
            remarks=[f"a batch could not be decoded ({type(error).__name__}: {error}); its bytes are kept"]
        )


@contextmanager
def endings_blocked() -> Iterator[None]:
    """Hold back the signals that end a capture; a process that is begun meanwhile never gets them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDINGS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class DecoderProcess:
    """Sends pieces to the decoders and collects what they give, without ever waiting for them.

    Attributes
    ----------
    undecoded : int
        Bytes that were not decoded because too many waited, or because the process has ended or was too slow.
    failed : bool
        Whether it has ended before its time.
    live_stats : LiveStats, optional
        How the live view did, when all is over.
    """

    def __init__(
        self,
        ports: tuple[PortSettings, ...],
        live: LiveWanted | None = None,
        online: Connection | None = None,
    ) -> None:
        self.undecoded = 0
        self.failed = False
        self.live_stats: LiveStats | None = None
        self._waiting: deque[Batch | None] = deque()
        self._bytes_waiting = 0
        self._sizes: deque[int] = deque()
        self._outcomes: deque[tuple[int, Outcome]] = deque()
        self._wake = threading.Condition()
        self._finished = threading.Event()
        context = get_context("spawn")
        self._here, there = context.Pipe()
        self._process = context.Process(
            target=serve, args=(there, ports, live, online), daemon=True, name="seatrial decoders"
        )
        with endings_blocked():
            self._process.start()
        there.close()
        threading.Thread(target=self._send, daemon=True).start()
        threading.Thread(target=self._receive, daemon=True).start()

    def put(self, batch: Batch) -> None:
        """Hand pieces (nanoseconds, bytes) of ports (by number) to the decoders."""
        size = _size(batch)
        with self._wake:
            if self.failed or self._bytes_waiting + size > MOST_WAITING:
                self.undecoded += size
                return
            self._bytes_waiting += size
            self._sizes.append(size)
            self._waiting.append(batch)
            self._wake.notify()

    def take(self) -> list[tuple[int, Outcome]]:
        """What has been decoded since the last call, by port number."""
        return [self._outcomes.popleft() for _ in range(len(self._outcomes))]

    def close(self, patience_s: float) -> None:
        """Let the decoders finish what waits, as long as they get on.

        They may be silent for ``patience_s`` at a time, and for longer where the machine gives them little to do it in.
        """
        with self._wake:
            self._waiting.append(None)
            self._wake.notify()
        left, used, silences = self._bytes_waiting, cpu_seconds(self.pid), 0
        while not self._finished.wait(patience_s):
            got = cpu_seconds(self.pid) - used
            silences = 0 if self._bytes_waiting < left else silences + 1
            left, used = self._bytes_waiting, used + got
            if silences and not (starved(got, patience_s) and silences <= MOST_SILENCES):
                self._process.kill()
                break
        self._process.join(1.0)
        with self._wake:
            self.undecoded += self._bytes_waiting
            self._bytes_waiting = 0
        self.failed = False

    @property
    def pid(self) -> int | None:
        """Number of the process."""
        return self._process.pid

    def _send(self) -> None:
        run_at_once()
        while True:
            with self._wake:
                while not self._waiting:
                    self._wake.wait()
                batch = self._waiting.popleft()
            try:
                self._here.send(batch)
            except OSError:
                return
            if batch is None:
                return

    def _receive(self) -> None:
        run_at_once()
        try:
            while (outcomes := self._here.recv()) is not None:
                if isinstance(outcomes, LiveStats):
                    self.live_stats = outcomes
                    continue
                count, decoded = outcomes
                self._outcomes.extend(decoded)
                with self._wake:
                    self._bytes_waiting -= sum(self._sizes.popleft() for _ in range(count))
        except (EOFError, OSError):
            self.failed = True
        self._finished.set()


def _size(batch: Batch) -> int:
    return sum(len(data) for _, pieces in batch for _, data in pieces)


def starved(cpu_s: float, waited_s: float) -> bool:
    """Whether a process got some processor time, and far less than there was: a busy machine, and no endless loop."""
    return 0 < cpu_s < waited_s / 2


def cpu_seconds(pid: int | None) -> float:
    """Processor time of a process so far; NaN where the system does not tell."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:  # noqa: PTH123
            fields: Any = file.read().rpartition(")")[2].split()
    except OSError:
        return float("nan")
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
