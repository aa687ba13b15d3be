"""Objects in the unpacked content of a BLF file, and how far those of a broken container can be believed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ingest.canbus.frames import Frames

CAN_MESSAGE, CAN_MESSAGE2, OTHER_CAN = 1, 86, (73, 100, 101)
TEN_MICROSECONDS = 1
#: A container says how much it unpacks to; more than this is a lie.
LARGEST_CONTAINER = 64 << 20
#: What is left of an object at the end of a container is kept for the next, up to this length.
LONGEST_OBJECT = 1 << 20
#: Bytes that may lie between objects.
PADDING = 7
#: In a broken container: objects before the first odd one that are not believed, and the longest pause that is, ns.
DOUBTED, LEAP_NS = 8, 1_000_000_000
#: A CAN message object: header (version 1 or 2: 32 bytes of it), then the message.
OBJECT = np.dtype(
    {
        "names": [
            "header",
            "version",
            "size",
            "type",
            "flags",
            "time",
            "channel",
            "kind",
            "dlc",
            "id",
            "data",
        ],
        "formats": ["<u2", "<u2", "<u4", "<u4", "<u4", "<i8", "<u2", "u1", "u1", "<u4", "(8,)u1"],
        "offsets": [4, 6, 8, 12, 16, 24, 32, 34, 35, 36, 40],
        "itemsize": 48,
    }
)
MESSAGE_HEADER = 32
REMOTE, EXTENDED = 0x80, 0x8000_0000


@dataclass(frozen=True)
class Objects:
    """Objects in unpacked content, that are complete: where each begins and ends, and its head."""

    at: NDArray[np.int64]
    ends: NDArray[np.int64]
    head: NDArray[np.void]

    @property
    def end(self) -> int:
        """Where an object begins that is not complete."""
        return int(self.ends[-1]) if len(self.at) else 0

    @property
    def message(self) -> NDArray[np.bool_]:
        """Which are CAN messages, (n,)."""
        of_kind = np.isin(self.head["type"], (CAN_MESSAGE, CAN_MESSAGE2))
        return np.asarray(of_kind & (self.head["size"] >= OBJECT.itemsize))

    def first(self, count: int) -> Objects:
        """The first of them."""
        return Objects(self.at[:count], self.ends[:count], self.head[:count])

    def holes(self, whole: bool) -> bool:
        """Whether anything lies between them; before the first too, where what came before is ``whole``."""
        begins = bool(len(self.at) and self.at[0] > PADDING) and whole
        return begins or bool((self.at[1:] - self.ends[:-1] > PADDING).any())

    def frames(self) -> tuple[Frames, int]:
        """CAN data frames, and the number of remote, error and CAN FD frames."""
        classic = self.message & (self.head["kind"] & REMOTE == 0) & (self.head["dlc"] <= 8)
        other = int((self.message & ~classic).sum() + np.isin(self.head["type"], OTHER_CAN).sum())
        return frames_of(self.head[classic]), other


def objects(content: bytes) -> Objects:
    """The objects in unpacked content."""
    text = np.frombuffer(content, np.uint8)
    at, head = candidates(text)
    ends = at + head["size"].astype(np.int64)
    whole = ends <= len(text)
    at, head, ends = at[whole], head[whole], ends[whole]
    outer = np.maximum.accumulate(np.concatenate([[0], ends[:-1]])) <= at
    return Objects(at[outer], ends[outer], head[outer])


def sound(found: Objects, before: Frames, contradicted: bool) -> int:
    """How many objects of a broken piece come before anything that is wrong with them.

    ``before`` are the last frames before it; its checksum may have ``contradicted`` all that is there.

    Nothing says where a stream of zlib broke. What follows is shifted as a rule, so that an object does not begin where
    the last one ends, or time leaps; a few objects before that are not believed either. Where only the checksum is
    wrong, any of them may be.
    """
    wrong = np.flatnonzero(odd(found, before))
    if len(wrong):
        return max(int(wrong[0]) - DOUBTED, 0)
    return 0 if contradicted else len(found.at)


def odd(found: Objects, before: Frames) -> NDArray[np.bool_]:
    """Objects that do not follow the one before them, in place or in time, (n,)."""
    message, wrong = found.message, np.zeros(len(found.at), dtype=bool)
    wrong[1:] = found.at[1:] - found.ends[:-1] > PADDING
    head = found.head[message]
    time = head["time"] * unit_of(head)
    leap = np.abs(np.diff(time, prepend=before.time_ns[-1:] if len(before) else time[:1])) > LEAP_NS
    strange = (head["header"] != MESSAGE_HEADER) | (head["version"] != 1) | ~np.isin(head["flags"], (1, 2))
    wrong[message] |= leap | strange
    return wrong


def unit_of(head: NDArray[np.void]) -> NDArray[np.int64]:
    """Nanoseconds per unit of the times of objects, (n,)."""
    return np.where(head["flags"] == TEN_MICROSECONDS, 10_000, 1)


def candidates(text: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.void]]:
    """Offsets and heads of everything that looks like an object."""
    room = len(text) - 15
    if room <= 0:
        return np.empty(0, np.int64), np.empty(0, OBJECT)
    first = np.flatnonzero(text[:room] == ord("L"))
    for k, letter in enumerate(b"OBJ", start=1):
        first = first[text[first + k] == letter]
    padded = np.concatenate([text, np.zeros(OBJECT.itemsize, np.uint8)])
    head = padded[first[:, None] + np.arange(OBJECT.itemsize)].view(OBJECT)[:, 0]
    sane = (head["header"] >= 16) & (head["size"] >= head["header"]) & (head["size"] <= LARGEST_CONTAINER)
    return first[sane], head[sane]


def frames_of(head: NDArray[np.void]) -> Frames:
    """The frames of CAN message objects."""
    ports, channel = np.unique(head["channel"], return_inverse=True)
    inside = np.arange(8) < head["dlc"][:, None]
    return Frames(
        head["time"] * unit_of(head),
        head["id"] & np.uint32(0x1FFF_FFFF),
        (head["id"] & np.uint32(EXTENDED)) != 0,
        channel.astype(np.int16),
        head["dlc"].astype(np.uint8),
        np.where(inside, head["data"], 0).astype(np.uint8),
        tuple(str(int(p) - 1) for p in ports) or ("",),
    )


def believed(parts: Sequence[Frames], doubtful: Sequence[bool]) -> Iterator[Frames]:
    """The frames of each piece; of a doubtful one up to an identifier that no piece without damage has."""
    known = np.unique(
        np.concatenate([p.can_id for p, doubt in zip(parts, doubtful, strict=True) if not doubt])
    )
    for part, doubt in zip(parts, doubtful, strict=True):
        strange = np.flatnonzero(~np.isin(part.can_id, known) & (doubt and len(known) > 0))
        yield part.take(np.arange(max(int(strange[0]) - DOUBTED, 0))) if len(strange) else part
