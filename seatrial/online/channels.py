"""Updates as messages of the capture: parameters, prediction errors and the monitor, each a channel of its own."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field

from seatrial.capture.channel_messages import identifier, unique
from seatrial.capture.recording_file import Message
from seatrial.capture.records import ChannelSpec
from seatrial.online.updates import Reading

_HEAD = b"\0\1\0\0"


@dataclass
class ReadingEncoder:
    """Turns readings into messages; a topic keeps its fields."""

    _layouts: dict[str, tuple[ChannelSpec, tuple[str, ...]]] = field(default_factory=dict)

    def message(self, reading: Reading, time_ns: int) -> Message:
        """The message of a reading; a value that it lacks is NaN."""
        known = self._layouts.get(reading.topic)
        if known is None or not reading.values.keys() <= set(known[1]):
            names = tuple(dict.fromkeys((*(known[1] if known else ()), *reading.values)))
            known = self._layouts[reading.topic] = (channel(reading, names), names)
        spec, names = known
        body = struct.pack(f"<{len(names)}d", *(reading.values.get(n, math.nan) for n in names))
        return Message(spec, time_ns, time_ns, _HEAD + body)


def channel(reading: Reading, names: Sequence[str]) -> ChannelSpec:
    """The channel of a topic, whose fields are numbers."""
    taken: set[str] = set()
    lines = []
    for name in names:
        unit = reading.units.get(name, "")
        remark = f"  # {unit}" if unit and unit.isascii() else ""
        lines.append(f"float64 {unique(identifier(name), taken)}{remark}\n")
    topic = f"/online/{reading.topic}"
    schema = f"seatrial/msg/Online{reading.topic.capitalize()}"
    return ChannelSpec(topic, "cdr", schema, "ros2msg", "".join(lines).encode())
