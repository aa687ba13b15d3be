"""CAN adapters that speak SLCAN: the lines are those of the log readers; here is what waits for its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from seatrial.capture.decoders import LONGEST, Tables
from seatrial.capture.piece_buffer import PieceBuffer
from seatrial.capture.recognised import Recognised

if TYPE_CHECKING:
    from ingest.canbus.frames import Frames

#: Frames of a packet that does not end are forgotten after so long, ns.
PATIENCE_NS = 2_000_000_000


class SlcanDecoder:
    """Decodes an SLCAN adapter on an NMEA 2000 network."""

    def __init__(self) -> None:
        from ingest.canbus.sources import sources

        self._buffer = PieceBuffer()
        self._known = Recognised(sources)
        self._instances = Instances()
        self._waiting: Frames | None = None

    def feed(self, pieces: Sequence[tuple[int, bytes]]) -> Tables:
        """Tables per PGN."""
        from ingest.canbus.slcan import scan

        self._buffer.add(pieces)
        found = scan(self._buffer.data)
        end = max(found.remainder, len(self._buffer.data) - LONGEST)
        frames = found.frames(self._buffer.times(found.end))
        self._buffer.drop(end)
        damaged = int((found.damage[:, 1] - found.damage[:, 0]).sum()) + end - found.remainder
        decoded = self._decoded(frames) if len(frames) else Tables()
        self._known.add(decoded.tables)
        seen = self._known.sources, len(frames), damaged, self._known.settled
        return Tables(decoded.tables, decoded.units, *seen)

    def _decoded(self, frames: Frames) -> Tables:
        from ingest.canbus.decoding import decoded
        from ingest.canbus.frames import Capture
        from ingest.reader import ReadOptions

        ready, self._waiting = complete(joined(self._waiting, frames))
        try:
            found = decoded(Capture(ready, {}, (), 0, "utc"), ReadOptions())
        except ValueError:
            return Tables()
        return self._instances.apart(Tables(found.tables, found.units))


@dataclass
class Instances:
    """Rudders and engines of a device that has several: a table of each, as in a log, though a batch may hold but one.

    Attributes
    ----------
    seen : dict of (topic, device) to set of int
        Instances that have reported a value.
    """

    seen: dict[tuple[str, int], set[int]] = field(default_factory=dict)

    def apart(self, tables: Tables) -> Tables:
        """The tables, and ``topic[k]`` for each instance k in them where a device has several."""
        from ingest.canbus.sources import ACTUATORS, valued
        from ingest.log import SOURCE

        found, units = dict(tables.tables), dict(tables.units)
        for rule in ACTUATORS:
            table = tables.tables.get(rule.topic)
            if table is None or "instance" not in table.columns:
                continue
            rows = valued(table, rule).dropna(subset=["instance"])
            for device, number in rows[[SOURCE, "instance"]].drop_duplicates().to_numpy(int).tolist():
                self.seen.setdefault((rule.topic, device), set()).add(number)
            mine = [k for (topic, _), k in self.seen.items() if topic == rule.topic]
            several = any(len(numbers) > 1 for numbers in mine)
            for number in sorted(set().union(*mine)) if several else ():
                part, name = table[table["instance"] == number], f"{rule.topic}[{number}]"
                if len(part):
                    found[name] = part
                    units |= {(name, c): u for (t, c), u in tables.units.items() if t == rule.topic}
        return Tables(found, units)


def joined(before: Frames | None, after: Frames) -> Frames:
    """Both, one after the other."""
    from ingest.canbus.frames import Frames

    if before is None or not len(before):
        return after
    return Frames(
        np.concatenate([before.time_ns, after.time_ns]),
        np.concatenate([before.can_id, after.can_id]),
        np.concatenate([before.extended, after.extended]),
        np.concatenate([before.channel, after.channel]),
        np.concatenate([before.dlc, after.dlc]),
        np.concatenate([before.data, after.data]),
        after.channels,
    )


def complete(frames: Frames) -> tuple[Frames, Frames]:
    """Split frames into those that can be decoded, and those of packets whose end has not come yet.

    The frames of a fast packet count up in the lower five bits of their first byte; the first of them has the
    packet's length in its second: six bytes of it there, seven in each that follows.
    """
    from ingest.canbus.layout import is_fast
    from ingest.canbus.n2k import pgn_of

    pgn = pgn_of(frames.can_id)
    fast = np.array([is_fast(int(p)) for p in np.unique(pgn)])[np.searchsorted(np.unique(pgn), pgn)]
    waiting = np.zeros(len(frames), bool)
    recent = frames.time_ns >= frames.time_ns[-1] - PATIENCE_NS
    for can_id in np.unique(frames.can_id[fast & frames.extended]):
        mine = np.flatnonzero(frames.can_id == can_id)
        starts = np.flatnonzero(frames.data[mine, 0] & 0x1F == 0)
        if not len(starts):
            continue
        last = mine[starts[-1] :]
        needed = 1 + max(0, -(-(int(frames.data[last[0], 1]) - 6) // 7))
        waiting[last] = len(last) < needed
    waiting &= recent
    return frames.take(~waiting), frames.take(waiting)
