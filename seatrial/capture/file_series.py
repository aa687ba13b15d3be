"""The files of a capture: begun, rotated, finished; what does not fit on the disk waits in memory."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from ingest.errors import UsageError
from seatrial.capture.device import reason
from seatrial.capture.priority import run_at_once
from seatrial.capture.recording_file import Message, RecordingFile
from seatrial.capture.settings import FLUSH_BYTES, CaptureSettings

#: Bytes of messages that may wait while the disk is full, and how long until it is tried again, s.
MOST_HELD, AGAIN_S = 1 << 28, 1.0
RAW = "/raw/"


class FileSeries:
    """Where the messages of a capture go.

    Attributes
    ----------
    paths : list of Path
        Files so far.
    trouble : str
        Why nothing can be written at the moment; empty where all is well.
    lost_bytes, lost_messages : int
        Raw bytes, and messages of other channels, that could never be written.
    """

    def __init__(self, settings: CaptureSettings) -> None:
        self.settings = settings
        self.paths: list[Path] = []
        self.trouble = ""
        self.lost_bytes = self.lost_messages = 0
        self._held: deque[Message] = deque()
        self._held_bytes = 0
        self._again = 0.0
        self._file = self._begin()
        self._began = time.monotonic()
        self._syncing = threading.Event()
        self._closing = False
        self._syncer = threading.Thread(target=self._sync_always, daemon=True, name="sync")
        self._syncer.start()

    @property
    def size(self) -> int:
        """Bytes in all files."""
        return sum(p.stat().st_size for p in self.paths if p.exists())

    def write(self, messages: Iterable[Message]) -> None:
        """Write messages; those that do not fit are written later, if the disk has room again."""
        for message in messages:
            if self.trouble and not is_raw(message):
                self.lost_messages += 1
                continue
            self._held.append(message)
            self._held_bytes += len(message.payload)
        if not self.trouble or time.monotonic() >= self._again:
            self._write_held()
        self._bound()

    def finish(self) -> None:
        """Write what waits, and the index."""
        self._write_held()
        self._closing = True
        self._syncing.set()
        self._syncer.join(10.0)
        for message in self._held:
            self._count_lost(message)
        self._held.clear()
        self._end()

    def _write_held(self) -> None:
        try:
            while self._held:
                self._rotate_if_due()
                part = self._part()
                self._file.append(part)
                for message in part:
                    self._held.popleft()
                    self._held_bytes -= len(message.payload)
                self._syncing.set()
        except OSError as error:
            if not self.trouble:
                self._keep_raw()
            self.trouble = reason(error)
            self._again = time.monotonic() + AGAIN_S
        else:
            self.trouble = ""

    def _part(self) -> list[Message]:
        """The oldest messages that wait, as many as make one chunk."""
        part, size = [], 0
        for message in self._held:
            part.append(message)
            size += len(message.payload)
            if size >= FLUSH_BYTES:
                break
        return part

    def _keep_raw(self) -> None:
        """When nothing can be written any more, keep the bytes of the ports alone."""
        self.lost_messages += sum(not is_raw(m) for m in self._held)
        self._held = deque(filter(is_raw, self._held))
        self._held_bytes = sum(len(m.payload) for m in self._held)

    def _bound(self) -> None:
        """Give up the oldest bytes where too many wait."""
        while self._held_bytes > MOST_HELD:
            message = self._held.popleft()
            self._held_bytes -= len(message.payload)
            self._count_lost(message)

    def _count_lost(self, message: Message) -> None:
        if is_raw(message):
            self.lost_bytes += len(message.payload)
        else:
            self.lost_messages += 1

    def _rotate_if_due(self) -> None:
        settings = self.settings
        aged = time.monotonic() - self._began >= settings.rotate_s
        if not settings.rotates or not (aged or self._file.size >= settings.rotate_bytes):
            return
        following = self._begin()
        self._end()
        self._file, self._began = following, time.monotonic()

    def _end(self) -> None:
        try:
            self._file.finish()
        except OSError as error:
            self.trouble = self.trouble or f"{reason(error)}; {self._file.path.name} has no index"

    def _begin(self) -> RecordingFile:
        file = RecordingFile(next_path(self.settings.out, self.settings.rotates))
        self.paths.append(file.path)
        return file

    def _sync_always(self) -> None:
        """Put on the disk what was written, beside the writing: a slow card does not hold it up."""
        run_at_once()
        while not self._closing:
            self._syncing.wait()
            self._syncing.clear()
            try:
                self._file.sync()
            except OSError:
                continue


def is_raw(message: Message) -> bool:
    """Whether a message holds bytes as a port sent them."""
    return message.channel.topic.startswith(RAW)


def next_path(out: Path, numbered: bool) -> Path:
    """The path of the next file that is not there yet."""
    named = out.with_name(out.name.replace("{utc}", datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")))
    if not numbered and "{utc}" not in out.name:
        return named
    first = (
        named.with_name(f"{named.stem}-001{named.suffix}") if numbered and "{utc}" not in out.name else named
    )
    number, path = 1, first
    while path.exists():
        number += 1
        path = named.with_name(f"{named.stem}-{number:03d}{named.suffix}")
    return path


def check_out(settings: CaptureSettings) -> None:
    """Check that the file can be written and overwrites nothing, before a port is opened.

    Raises
    ------
    UsageError
        The folder is not there or may not be written to, or the file is there.
    """
    out = settings.out
    if out.suffix.lower() != ".mcap":
        raise UsageError(f"--out: expected a file that ends in .mcap, found {out}.")
    if not out.parent.is_dir():
        raise UsageError(f"{out}: the folder {out.parent} is not there; make it first.")
    path = next_path(out, settings.rotates)
    if path.exists():
        raise UsageError(
            f"{path}: there is such a file, and it is not overwritten. Name another, or put {{utc}} into the name."
        )
    try:
        with path.open("xb"):
            pass
        path.unlink()
    except OSError as error:
        raise UsageError(f"{path}: cannot be written ({reason(error)}).") from error
