"""Bytes that wait to be decoded, with the times at which they arrived."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]


@dataclass
class PieceBuffer:
    """The end of a stream.

    Attributes
    ----------
    data : bytes
    """

    data: bytes = b""
    _offsets: list[int] = field(default_factory=list)
    _times: list[int] = field(default_factory=list)

    def add(self, pieces: Sequence[tuple[int, bytes]]) -> None:
        """Append pieces: nanoseconds of arrival, bytes."""
        at = len(self.data)
        for time, data in pieces:
            self._offsets.append(at)
            self._times.append(time)
            at += len(data)
        self.data = b"".join((self.data, *(data for _, data in pieces)))

    def drop(self, count: int) -> None:
        """Forget the first ``count`` bytes."""
        self.data = self.data[count:]
        keep = (
            max(0, int(np.searchsorted(self._offsets, count, side="right")) - 1)
            if self.data
            else len(self._times)
        )
        self._offsets = [max(0, o - count) for o in self._offsets[keep:]]
        self._times = self._times[keep:]

    @property
    def arrival(self) -> tuple[Integers, Integers]:
        """Offsets and times of the pieces, (n,) each."""
        return np.array(self._offsets, np.int64), np.array(self._times, np.int64)

    def times(self, ends: Integers) -> Integers:
        """When the byte before each of ``ends`` arrived, (n,)."""
        offsets, times = self.arrival
        piece = np.searchsorted(offsets, ends - 1, side="right") - 1
        return times[np.clip(piece, 0, len(times) - 1)]
