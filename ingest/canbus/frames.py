"""CAN frames and NMEA 2000 packets as columns, apart from what they mean and how they were recorded."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ingest.log import Finding


@dataclass(frozen=True)
class Frames:
    """CAN frames in the order of recording.

    Attributes
    ----------
    time_ns : (n,) int64
        Nanoseconds on the log's clock.
    can_id : (n,) uint32
        Identifier, without flag bits.
    extended : (n,) bool
        Whether the identifier has 29 bits.
    channel : (n,) int16
        Index into ``channels``.
    dlc : (n,) uint8
        Number of data bytes.
    data : (n, 8) uint8
        Data bytes, 0 beyond ``dlc``.
    channels : tuple of str
        Names of the buses.
    """

    time_ns: NDArray[np.int64]
    can_id: NDArray[np.uint32]
    extended: NDArray[np.bool_]
    channel: NDArray[np.int16]
    dlc: NDArray[np.uint8]
    data: NDArray[np.uint8]
    channels: tuple[str, ...] = ("",)

    def __len__(self) -> int:
        return len(self.time_ns)

    def take(self, index: NDArray[np.int64] | NDArray[np.bool_]) -> Frames:
        """The frames that an index or a mask selects."""
        return Frames(
            self.time_ns[index],
            self.can_id[index],
            self.extended[index],
            self.channel[index],
            self.dlc[index],
            self.data[index],
            self.channels,
        )


@dataclass(frozen=True)
class Packets:
    """Complete payloads of one PGN.

    Attributes
    ----------
    time_ns : (n,) int64
        When the first frame was recorded.
    source : (n,) uint8
        Address of the sender.
    length : (n,) int64
        Number of payload bytes.
    payload : (n, m) uint8
        Payload bytes, 0 beyond ``length``.
    """

    time_ns: NDArray[np.int64]
    source: NDArray[np.uint8]
    length: NDArray[np.int64]
    payload: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.time_ns)

    def take(self, index: NDArray[np.int64] | NDArray[np.bool_]) -> Packets:
        """The packets that an index or a mask selects."""
        return Packets(self.time_ns[index], self.source[index], self.length[index], self.payload[index])


@dataclass(frozen=True)
class Capture:
    """What a transport gives: frames, or packets that another program has assembled, or both.

    Attributes
    ----------
    frames : Frames
    packets : mapping of int to Packets
        By PGN.
    findings : tuple of Finding
    bytes_damaged : int
    clock : str
        What the times count from: ``"utc"`` (since 1970, UTC), ``"day"`` (since midnight, UTC) or
        ``"start"``.
    """

    frames: Frames
    packets: dict[int, Packets] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    bytes_damaged: int = 0
    clock: str = "start"


def no_frames() -> Frames:
    """Frames of an empty log."""
    return Frames(
        np.empty(0, np.int64),
        np.empty(0, np.uint32),
        np.empty(0, np.bool_),
        np.empty(0, np.int16),
        np.empty(0, np.uint8),
        np.empty((0, 8), np.uint8),
    )


def joined(parts: Iterable[Frames]) -> Frames:
    """Frames of several stretches, one after the other; channels are told apart by name."""
    some = [p for p in parts if len(p)]
    if not some:
        return no_frames()
    names = tuple(dict.fromkeys(name for p in some for name in p.channels))
    channel = [np.array([names.index(c) for c in p.channels], np.int16)[p.channel] for p in some]
    return Frames(
        np.concatenate([p.time_ns for p in some]),
        np.concatenate([p.can_id for p in some]),
        np.concatenate([p.extended for p in some]),
        np.concatenate(channel),
        np.concatenate([p.dlc for p in some]),
        np.concatenate([p.data for p in some]),
        names,
    )


def implausible_lengths(frames: Frames, doubtful: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Frames of doubtful records that are shorter than their identifier usually is; (n,) bool.

    A record that was cut within its data still reads as a shorter frame. It is taken for whole only if
    frames of the same identifier from undamaged records are no longer than it.
    """
    if not doubtful.any():
        return doubtful
    ids, inverse = np.unique(frames.can_id, return_inverse=True)
    longest = np.full(len(ids), 8, np.int64)
    sure = ~doubtful
    seen = np.zeros(len(ids), np.int64)
    np.maximum.at(seen, inverse[sure], frames.dlc[sure].astype(np.int64))
    known = np.bincount(inverse[sure], minlength=len(ids)) > 0
    longest[known] = seen[known]
    short: NDArray[np.bool_] = doubtful & (frames.dlc < longest[inverse])
    return short
