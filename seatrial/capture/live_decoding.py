"""All ports' decoders together: pieces in; messages, counts and remarks out."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from seatrial.capture.channel_messages import Encoded, TableEncoder
from seatrial.capture.decoders import Decoder, Tables, decoder_for
from seatrial.capture.detection import WINDOW, detect, suspicion
from seatrial.capture.settings import PortSettings, Protocol

#: Bytes that are held until the protocol is known, and how many must have come since it was last looked for.
HELD, AGAIN = 1 << 22, 32
#: Bytes without a whole record after which the line rate is doubted again.
NONSENSE = 4096

Pieces = Sequence[tuple[int, bytes]]
Watcher = Callable[[str, Tables], None]


@dataclass
class Outcome:
    """What a port's pieces gave.

    Attributes
    ----------
    messages : list of Encoded
    records, damaged : int
        Records decoded, and bytes that belong to none.
    protocol : Protocol, optional
        Set once, when it has been recognised.
    remarks : list of str
        Lines for the person.
    """

    messages: list[Encoded] = field(default_factory=list)
    records: int = 0
    damaged: int = 0
    protocol: Protocol | None = None
    remarks: list[str] = field(default_factory=list)


class PortDecoder:
    """Finds out what a port speaks, and decodes it."""

    def __init__(self, settings: PortSettings, watchers: Sequence[Watcher] = ()) -> None:
        self.settings = settings
        self._watchers = tuple(watchers)
        self._encoder = TableEncoder(settings.name)
        self._decoder: Decoder | None = decoder_for(settings.protocol.value)
        self._held: deque[tuple[int, bytes]] = deque()
        self._held_bytes = 0
        self._looked_at = self._nonsense = self._seen = 0
        self._suspected = False

    def feed(self, pieces: Pieces) -> Outcome:
        """Decode pieces (nanoseconds, bytes)."""
        outcome = Outcome()
        self._seen += sum(len(data) for _, data in pieces)
        if self._decoder is None:
            if self.settings.protocol is not Protocol.auto:
                return outcome
            pieces = self._recognise(pieces, outcome)
        if self._decoder is not None and pieces:
            self._decode(pieces, outcome)
        return outcome

    def _recognise(self, pieces: Pieces, outcome: Outcome) -> Pieces:
        """Hold pieces until the protocol is known, then give all of them."""
        self._held += pieces
        self._held_bytes += sum(len(data) for _, data in pieces)
        while self._held_bytes > HELD and len(self._held) > 1:
            self._held_bytes -= len(self._held.popleft()[1])
        if self._seen - self._looked_at < AGAIN:
            return []
        self._looked_at = self._seen
        data = latest(self._held, WINDOW)
        outcome.protocol = detect(data)
        if outcome.protocol is None:
            self._suspect(data, outcome)
            return []
        self._decoder = decoder_for(outcome.protocol.value)
        ready = list(self._held)
        self._held.clear()
        return ready

    def _suspect(self, data: bytes, outcome: Outcome) -> None:
        doubt = None if self._suspected else suspicion(data, self.settings.baud)
        if doubt:
            self._suspected = True
            outcome.remarks.append(doubt)

    def _decode(self, pieces: Pieces, outcome: Outcome) -> None:
        assert self._decoder is not None
        found = self._decoder.feed(pieces)
        outcome.records, outcome.damaged = found.messages, found.damaged
        encoded = (self._encoder.encode(t, table, found.units) for t, table in found.tables.items())
        outcome.messages += [e for e in encoded if e is not None]
        for watcher in self._watchers:
            watcher(self.settings.name, found)
        self._doubt(sum(len(data) for _, data in pieces), found.messages, outcome)

    def _doubt(self, size: int, records: int, outcome: Outcome) -> None:
        """Say so, once per stretch, when bytes keep coming and no record is among them."""
        if records:
            if self._nonsense >= NONSENSE:
                outcome.remarks.append("good records again")
            self._nonsense = 0
            return
        before, self._nonsense = self._nonsense, self._nonsense + size
        if before < NONSENSE <= self._nonsense:
            outcome.remarks.append(
                f"{self._nonsense} bytes without a good record; is {self.settings.baud} the right baud rate?"
            )


def latest(pieces: Iterable[tuple[int, bytes]], size: int) -> bytes:
    """The last bytes of pieces, at least ``size`` of them where there are so many."""
    found: list[bytes] = []
    for _, data in reversed(list(pieces)):
        found.append(data)
        size -= len(data)
        if size <= 0:
            break
    return b"".join(reversed(found))
