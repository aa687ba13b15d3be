"""Fast packets: frames that carry one payload, put together per bus, sender, PGN and sequence number.

The first byte of a frame holds the sequence number (3 bits) and the frame's number (5 bits); the second byte
of frame 0 the length of the payload. Frame 0 carries 6 bytes, each further one 7. A packet is taken only if
all its frames are there, in order and without a pause: a lost frame loses the packet, and is counted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ingest.canbus.frames import Frames, Packets

#: A pause between two frames of a packet; the standard allows 750 ms.
PAUSE_NS = 750_000_000
LONGEST = 223


def assemble(frames: Frames) -> tuple[Packets, int]:
    """Payloads of the fast packets among frames of one PGN.

    Parameters
    ----------
    frames : Frames
        Of one PGN, in the order of recording.

    Returns
    -------
    packets : Packets
        In the order of their first frames.
    lost : int
        Number of packets of which some frame is missing.
    """
    order = np.argsort(stream_key(frames), kind="stable")
    frames = frames.take(order)
    key, number = stream_key(frames), frames.data[:, 0] & 0x1F
    opens = number == 0
    opens[:1] = True
    opens[1:] |= (key[1:] != key[:-1]) | (np.diff(frames.time_ns) > PAUSE_NS)
    first = np.flatnonzero(opens)
    place = np.arange(len(frames)) - np.repeat(first, np.diff(np.append(first, len(frames))))
    length = frames.data[first, 1].astype(np.int64)
    needed = 1 + np.maximum(length - 6 + 6, 0) // 7
    whole = complete(frames, first, needed, number == place) & (length <= LONGEST) & (length > 0)
    chosen = first[whole]
    packets = gathered(frames, chosen, needed[whole], length[whole])
    in_time = np.argsort(order[chosen], kind="stable")
    return packets.take(in_time), int((~whole).sum())


def stream_key(frames: Frames) -> NDArray[np.int64]:
    """One number per bus, priority, sender, addressee and sequence number; (n,)."""
    sequence = (frames.data[:, 0] >> 5).astype(np.int64)
    return (frames.channel.astype(np.int64) << 40) | (frames.can_id.astype(np.int64) << 3) | sequence


def complete(
    frames: Frames, first: NDArray[np.int64], needed: NDArray[np.int64], in_place: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Groups, opened by ``first``, that have all their frames, in place and long enough; (groups,)."""
    ends = np.append(first[1:], len(frames))
    last = np.minimum(first + needed, ends)
    full = in_place & (frames.dlc == 8)
    right = np.concatenate([[0], np.cumsum(full)])
    short_last = in_place[last - 1] & ~full[last - 1] & enough(frames, first, needed, last)
    good = right[last] - right[first] + short_last
    return np.asarray((ends - first >= needed) & (good == needed), dtype=np.bool_)


def enough(
    frames: Frames, first: NDArray[np.int64], needed: NDArray[np.int64], last: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether the last frame of each group, if it is a short one, holds what is still missing; (groups,)."""
    length = frames.data[first, 1].astype(np.int64)
    missing = np.where(needed == 1, length + 1, length - 6 - 7 * (needed - 2))
    return np.asarray(frames.dlc[last - 1].astype(np.int64) - 1 >= missing, dtype=np.bool_)


def gathered(
    frames: Frames, first: NDArray[np.int64], needed: NDArray[np.int64], length: NDArray[np.int64]
) -> Packets:
    """The payloads of complete packets whose frames follow one another."""
    most = int(needed.max(initial=1))
    steps = np.arange(most)
    rows = np.minimum(first[:, None] + steps, len(frames) - 1)
    block = frames.data[rows][:, :, 1:].reshape(len(first), most * 7)[:, 1:]
    payload = np.where(np.arange(block.shape[1]) < length[:, None], block, 0).astype(np.uint8)
    source = (frames.can_id[first] & 0xFF).astype(np.uint8)
    return Packets(frames.time_ns[first], source, length, payload)
