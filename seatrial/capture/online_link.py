"""The way of decoded batches from the decoders to the identification."""

from __future__ import annotations

import queue
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from seatrial.capture.decoders import Tables

#: Batches that may wait for the identification.
MOST_BATCHES = 2000


class OnlineLink:
    """Hands decoded batches to the identification without waiting for it.

    Attributes
    ----------
    left_out : int
        Batches that there was no room for.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._queue: queue.Queue[tuple[str, Tables] | None] = queue.Queue(MOST_BATCHES)
        self.left_out = 0
        self._thread = threading.Thread(target=self._send, daemon=True, name="online link")
        self._thread.start()

    def show(self, port: str, tables: Tables) -> None:
        """Hand a batch over."""
        try:
            self._queue.put_nowait((port, tables))
        except queue.Full:
            self.left_out += 1

    def close(self) -> None:
        """Let what waits go, and say that it was all: the number of batches that were left out."""
        with suppress(queue.Full):
            self._queue.put(None, timeout=5.0)
            self._thread.join(5.0)

    def _send(self) -> None:
        while True:
            batch = self._queue.get()
            try:
                self._connection.send(batch if batch is not None else self.left_out)
            except OSError:
                return
            if batch is None:
                return
