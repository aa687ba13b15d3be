"""Tables to messages of decoded channels: ROS 2's CDR, whose definition travels in the file.

All numbers are ``float64``, in front, then the texts; so the messages of a table are laid out in one go, and
Foxglove, Rerun and `ingest.read_log` need nothing but the file to read them.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from seatrial.capture.records import ChannelSpec

if TYPE_CHECKING:
    import pandas as pd

_HEAD = b"\0\1\0\0"
EVENTS = ChannelSpec(
    "/capture/events",
    "cdr",
    "rcl_interfaces/msg/Log",
    "ros2msg",
    b"builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n"
    + b"=" * 80
    + b"\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
)


@dataclass(frozen=True)
class Encoded:
    """Messages of one channel: (n,) times in nanoseconds, and payloads."""

    channel: ChannelSpec
    times: list[int]
    payloads: list[bytes]


@dataclass
class TableEncoder:
    """Turns the tables of one port into messages; a topic keeps its columns as long as they suffice.

    Attributes
    ----------
    port : str
        The topics are ``/PORT/TOPIC``.
    """

    port: str
    _columns: dict[str, tuple[ChannelSpec, tuple[str, ...], tuple[str, ...]]] = field(default_factory=dict)

    def encode(self, topic: str, table: pd.DataFrame, units: Mapping[tuple[str, str], str]) -> Encoded | None:
        """Messages of a table; None where it has no rows or columns."""
        if not len(table) or not len(table.columns):
            return None
        channel, numbers, texts = self._layout(topic, table, units)
        fixed = (
            np.column_stack([_numbers(table, name) for name in numbers])
            if numbers
            else np.empty((len(table), 0))
        )
        body = (
            np.ascontiguousarray(fixed, "<f8").view(np.uint8).reshape(len(table), 8 * len(numbers)).tobytes()
        )
        width = 8 * len(numbers)
        parts = [
            [_HEAD + body[i : i + width] for i in range(0, len(body), width)]
            if width
            else [_HEAD] * len(table)
        ]
        parts += [_texts(table, name) for name in texts]
        payloads = [b"".join(row) for row in zip(*parts, strict=True)] if texts else parts[0]
        return Encoded(channel, table.index.to_numpy().tolist(), payloads)

    def _layout(
        self, topic: str, table: pd.DataFrame, units: Mapping[tuple[str, str], str]
    ) -> tuple[ChannelSpec, tuple[str, ...], tuple[str, ...]]:
        known = self._columns.get(topic)
        if known is not None and set(map(str, table.columns)) <= {*known[1], *known[2]}:
            return known
        before = (known[1], known[2]) if known else ((), ())
        text = {str(c) for c in table.columns if _is_text(table[c])} | set(before[1])
        names = list(dict.fromkeys([*before[0], *before[1], *map(str, table.columns)]))
        numbers, texts = tuple(n for n in names if n not in text), tuple(n for n in names if n in text)
        channel = ChannelSpec(
            f"/{self.port}/{topic}", "cdr", f"seatrial/msg/{identifier(topic)}", "ros2msg",
            definition(topic, numbers, texts, units), (("decoded_from", f"/raw/{self.port}"),),
        )  # fmt: skip
        self._columns[topic] = channel, numbers, texts
        return self._columns[topic]


def definition(
    topic: str, numbers: Sequence[str], texts: Sequence[str], units: Mapping[tuple[str, str], str]
) -> bytes:
    """The message's definition, with the units as remarks."""
    taken: set[str] = set()
    lines = []
    for kind, names in (("float64", numbers), ("string", texts)):
        for name in names:
            unit = units.get((topic, name), "")
            remark = f"  # {unit}" if unit and unit.isascii() else ""
            lines.append(f"{kind} {unique(identifier(name), taken)}{remark}\n")
    return "".join(lines).encode()


def identifier(name: str) -> str:
    """A name that a message definition may have."""
    plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")
    return plain if plain[:1].isalpha() else f"f_{plain}"


def unique(name: str, taken: set[str]) -> str:
    """The name, with a number where it is taken."""
    number, candidate = 2, name
    while candidate in taken:
        candidate, number = f"{name}_{number}", number + 1
    taken.add(candidate)
    return candidate


def _is_text(column: pd.Series) -> bool:
    return not (column.dtype.kind in "biuf" if isinstance(column.dtype, np.dtype) else False)


def _numbers(table: pd.DataFrame, name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return table[name].to_numpy(np.float64) if name in table else np.full(len(table), np.nan)


def _texts(table: pd.DataFrame, name: str) -> list[bytes]:
    if name not in table:
        return [string("")] * len(table)
    known: dict[object, bytes] = {}
    return [known.setdefault(v, string(v if isinstance(v, str) else "")) for v in table[name].tolist()]


def string(value: str) -> bytes:
    """A text as CDR has it: length, bytes, zero, and zeros up to the next multiple of four."""
    raw = value.encode() + b"\0"
    return struct.pack("<I", len(raw)) + raw + b"\0" * (-len(raw) % 4)


def event_message(wall_ns: int, level: int, name: str, text: str) -> bytes:
    """An event as ``rcl_interfaces/msg/Log``; ``level`` is 2 for information, 3 a warning, 4 an error."""
    second, nano = divmod(wall_ns, 1_000_000_000)
    head = _HEAD + struct.pack("<iIBxxx", second & 0x7FFFFFFF, nano, 10 * level)
    return head + string(name) + string(text) + string("") * 2 + struct.pack("<I", 0)


def status_channel(port: str) -> ChannelSpec:
    """The channel of a port's counts, once a second."""
    text = "".join(f"float64 {name}\n" for name in STATUS).encode()
    return ChannelSpec(f"/capture/{port}", "cdr", "seatrial/msg/PortStatus", "ros2msg", text)


#: Bytes so far, bytes per second, records decoded, damaged bytes, seconds since the last byte, whether open.
STATUS = ("bytes", "rate", "records", "damaged_bytes", "age", "open")


def status_message(values: Sequence[float]) -> bytes:
    """Values of ``STATUS``."""
    return _HEAD + struct.pack(f"<{len(STATUS)}d", *values)
