"""Play the recorded bytes of ports back through pseudo terminals, at their own pace."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import struct
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ingest.errors import DataError, UsageError, nearest
from ingest.ros.raw import is_raw
from ingest.ros.records import Contents, batches
from seatrial.capture.recovery import mapped

#: How long what was sent may wait in the terminal for its reader at the end, s.
LINGER_S = 10.0
#: How often in a row the terminal must be found empty: bytes are on their way into it for a moment.
SURE = 20


@dataclass(frozen=True)
class Recorded:
    """The bytes of one port.

    Attributes
    ----------
    topic : str
    data : bytes
    ends : (n,) int64
        Where each piece ends.
    times : (n,) int64
        When it arrived, nanoseconds.
    baud : int
        Line rate, where it is recorded, else 0.
    """

    topic: str
    data: bytes = field(repr=False)
    ends: NDArray[np.int64] = field(repr=False)
    times: NDArray[np.int64] = field(repr=False)
    baud: int = 0


def recorded_ports(path: Path, topic: str | None = None) -> list[Recorded]:
    """The raw channels of a capture, finished or not.

    Raises
    ------
    UsageError
        There is no such file, or no such channel.
    DataError
        The file is no MCAP, or has no raw channel.
    """
    if not path.is_file():
        raise UsageError(f"{path}: there is no such file.")
    contents, pieces = Contents(), dict[str, list[tuple[int, bytes]]]()
    facts: dict[str, str] = {}
    try:
        for batch in batches(mapped(path), contents):
            rows = zip(batch.channel.tolist(), batch.start.tolist(), batch.end.tolist(), batch.log_time.tolist(),
                       strict=True)  # fmt: skip
            for number, start, end, time_ns in rows:
                channel = contents.channels.get(number)
                if channel is not None and is_raw(channel):
                    facts[channel.topic] = channel.metadata.get("baud", "")
                    pieces.setdefault(channel.topic, []).append((time_ns, batch.data[start:end].tobytes()))
    except ValueError as error:
        raise DataError(
            f"{path}: {error}; `seatrial replay` plays captures of `seatrial capture` back."
        ) from error
    if not pieces:
        raise DataError(f"{path}: no channel holds the bytes of a port; there is nothing to play back.")
    if topic is not None and topic not in pieces:
        near = nearest(topic, pieces) or sorted(pieces)
        raise UsageError(
            f"{path}: no channel '{topic}' holds the bytes of a port. There are: {', '.join(near)}."
        )
    return [recorded(t, p, facts[t]) for t, p in sorted(pieces.items()) if topic in (None, t)]


def recorded(topic: str, pieces: list[tuple[int, bytes]], baud: str) -> Recorded:
    """Pieces, joined."""
    sizes = np.array([len(data) for _, data in pieces], np.int64)
    times = np.maximum.accumulate(np.array([t for t, _ in pieces], np.int64))
    return Recorded(
        topic, b"".join(d for _, d in pieces), np.cumsum(sizes), times, int(baud) if baud.isdigit() else 0
    )


class Line:
    """A pseudo terminal that stands for a serial port.

    Attributes
    ----------
    name : str
        Path of the device that a reader opens: the link, where one was asked for.
    sent, refused : int
        Bytes that went through, and that there was no room for because nobody read: a real line would have
        lost them.
    """

    def __init__(self, link: Path | None = None) -> None:
        self._master, slave = pty.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        self.device = os.ttyname(slave)
        os.close(slave)
        self.link = link
        self.sent = self.refused = 0
        if link is not None:
            make_link(link, self.device)

    @property
    def name(self) -> str:
        """The path to open."""
        return str(self.link or self.device)

    def has_reader(self) -> bool:
        """Whether somebody has opened the other end."""
        poller = select.poll()
        poller.register(self._master, 0)
        return not any(event & select.POLLHUP for _, event in poller.poll(0))

    def send(self, data: bytes) -> None:
        """Send without waiting; what does not fit is refused."""
        try:
            done = os.write(self._master, data)
        except (BlockingIOError, OSError):
            done = 0
        self.sent += done
        self.refused += len(data) - done

    def close(self) -> None:
        """Hang up, when the reader has taken what was sent or has had time enough to."""
        end, empty = time.monotonic() + LINGER_S, 0
        while time.monotonic() < end and self.has_reader() and empty < SURE:
            empty = 0 if self._waiting() else empty + 1
            time.sleep(0.05)
        os.close(self._master)
        if self.link is not None and self.link.is_symlink():
            self.link.unlink()

    def _waiting(self) -> int:
        """Bytes that the reader has not taken."""
        try:
            slave = os.open(self.device, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError:
            return 1
        try:
            return int(struct.unpack("i", fcntl.ioctl(slave, termios.FIONREAD, bytes(4)))[0])
        finally:
            os.close(slave)


def make_link(link: Path, device: str) -> None:
    """Make a link to a device; only a link is ever replaced.

    Raises
    ------
    UsageError
        Something else is there, or the link cannot be made.
    """
    try:
        if link.is_symlink():
            link.unlink()
        link.symlink_to(device)
    except OSError as error:
        raise UsageError(f"{link}: a link to the port cannot be made there ({error.strerror}).") from error


def play(
    ports: Sequence[Recorded],
    lines: Sequence[Line],
    stop: threading.Event,
    speed: float = 1.0,
    progress: Callable[[float], None] = lambda share: None,
) -> None:
    """Send every piece at its time, all ports on one clock.

    Parameters
    ----------
    ports, lines : sequences of the same length
    stop : Event
        Ends it early.
    speed : float
        How many times faster than recorded.
    progress : callable
        Is told the share that is done, about once a second.
    """
    began = time.monotonic()
    first = min(int(p.times[0]) for p in ports)
    whole = max(int(p.times[-1]) for p in ports) - first
    for time_ns, index, data in in_order(ports):
        due = began + (time_ns - first) * 1e-9 / speed
        while (wait := due - time.monotonic()) > 0:
            if stop.wait(min(wait, 1.0)):
                return
            progress((time_ns - first) / max(whole, 1))
        if stop.is_set():
            return
        lines[index].send(data)


def in_order(ports: Sequence[Recorded]) -> Iterator[tuple[int, int, bytes]]:
    """Time, number of the port, bytes, of all pieces of all ports by time."""
    times = np.concatenate([p.times for p in ports])
    index = np.concatenate([np.full(len(p.times), i) for i, p in enumerate(ports)])
    ends = np.concatenate([p.ends for p in ports])
    starts = np.concatenate([np.concatenate(([0], p.ends[:-1])) for p in ports])
    for k in np.argsort(times, kind="stable").tolist():
        i = int(index[k])
        yield int(times[k]), i, ports[i].data[int(starts[k]) : int(ends[k])]
