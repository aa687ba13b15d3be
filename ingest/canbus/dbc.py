"""Frames that a DBC file describes → one table per message, by column; layouts come from cantools.

An extended identifier is compared exactly; where that fails, without priority and sender, as J1939 and NMEA
2000 use them: the column ``source`` is the sender. A message with an identifier of 11 bits, which names no sender,
has the number of its bus there if it comes over several. Multiplexed signals are NaN where another page was sent.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.canbus.frames import Frames
from ingest.canbus.n2k import Tables, pgn_of, raw_bits, signed_integers
from ingest.errors import UsageError
from ingest.log import SOURCE, Finding, Source

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal


def decode_dbc(frames: Frames, path: Path) -> tuple[Tables, Frames]:
    """Tables of the messages that a DBC file describes, and the frames that it does not.

    Raises
    ------
    UsageError
        The file is not there or is no DBC file.
    """
    database = load(path)
    free = np.ones(len(frames), np.bool_)
    chosen: dict[str, NDArray[np.bool_]] = {}
    for message, rows in matched(database, frames):
        rows = rows & free
        free &= ~rows
        chosen[message.name] = chosen.get(message.name, False) | rows
    found = {m.name: (m, frames.take(chosen[m.name])) for m in database.messages if chosen[m.name].any()}
    tables = {name: table_of(message, mine) for name, (message, mine) in found.items()}
    units = {
        (name, s.name): s.unit for name, (message, _) in found.items() for s in message.signals if s.unit
    }
    notes = tuple(n for name, (message, mine) in found.items() for n in buses(message, mine))
    senders = {name: message.senders[0] for name, (message, _) in found.items() if message.senders}
    return Tables(tables, units, notes, int((~free).sum()), senders), frames.take(free)


def buses(message: Message, frames: Frames) -> Iterator[Finding]:
    """What is said of a message that names no sender and comes over several buses."""
    used = np.unique(frames.channel)
    if not message.is_extended_frame and len(used) > 1:
        told = ", ".join(f"{frames.channels[k]} is source {k}" for k in used.tolist())
        yield Finding("note", f"several buses carry it: {told}", topic=message.name)


def named_sources(found: Tables) -> tuple[Source, ...]:
    """What the names of the signals say that they hold, best first."""
    from ingest.tabular.naming import sources_of

    by_topic = {t: {f: u for (topic, f), u in found.units.items() if topic == t} for t in found.tables}
    return tuple(s for t, table in found.tables.items() for s in sources_of(table, by_topic[t], t))


def load(path: Path) -> Database:
    """The database in a DBC file."""
    from cantools.database import load_file
    from cantools.database.errors import Error

    try:
        return cast("Database", load_file(str(path), strict=False))
    except OSError as error:
        raise UsageError(
            f"[can] dbc: expected a DBC file, found none at {path}: {error.strerror}."
        ) from error
    except (Error, ValueError) as error:
        raise UsageError(
            f"[can] dbc: {path} is no DBC file that cantools can read: {in_short(str(error))}."
        ) from error


def in_short(text: str, most: int = 80) -> str:
    """The plain characters of one line: an error of cantools holds the file's own bytes."""
    line = " ".join("".join(c if " " <= c <= "~" else " " for c in text).split())
    return f"{line[:most]}…" if len(line) > most else line


def matched(database: Database, frames: Frames) -> Iterator[tuple[Message, NDArray[np.bool_]]]:
    """Each message with its frames: first those whose identifiers agree, then those whose PGNs agree."""
    for message in database.messages:
        yield message, (frames.can_id == message.frame_id) & (frames.extended == message.is_extended_frame)
    numbers = pgn_of(frames.can_id)
    for message in database.messages:
        if message.is_extended_frame:
            number = pgn_of(np.array([message.frame_id & 0x1FFF_FFFF], np.uint32))[0]
            yield message, frames.extended & (numbers == number)


def table_of(message: Message, frames: Frames) -> pd.DataFrame:
    """The table of one message."""
    columns: dict[str, NDArray[np.generic]] = {}
    if message.is_extended_frame:
        columns[SOURCE] = (frames.can_id & 0xFF).astype(np.int16)
    elif len(np.unique(frames.channel)) > 1:
        columns[SOURCE] = frames.channel
    columns |= {s.name: signal_column(s, message, frames) for s in message.signals}
    return pd.DataFrame(columns, index=pd.Index(frames.time_ns, name="t_ns"), copy=False)


def signal_column(signal: Signal, message: Message, frames: Frames) -> NDArray[np.float64]:
    """Physical values of one signal; (n,)."""
    raw, missing = raw_signal(signal, frames)
    values = raw_number(signal, raw).astype(np.float64) * float(signal.scale) + float(signal.offset)
    if signal.multiplexer_ids and signal.multiplexer_signal:
        selector = message.get_signal_by_name(signal.multiplexer_signal)
        page, absent = raw_signal(selector, frames)
        missing = missing | absent | ~np.isin(page, np.array(signal.multiplexer_ids, np.uint64))
    values[missing] = np.nan
    return values


def raw_signal(signal: Signal, frames: Frames) -> tuple[NDArray[np.uint64], NDArray[np.bool_]]:
    """Raw bits of a signal, and where the frame is too short for it; (n,)."""
    start, length = signal.start, signal.length
    if signal.byte_order == "little_endian":
        return raw_bits(frames.data, start, length), frames.dlc.astype(np.int64) * 8 < start + length
    first = 8 * (start // 8) + 7 - start % 8  # counted from the most significant bit of byte 0
    mirrored = np.ascontiguousarray(frames.data[:, ::-1])
    width = frames.data.shape[1] * 8
    return raw_bits(mirrored, width - first - length, length), frames.dlc.astype(
        np.int64
    ) * 8 < first + length


def raw_number(signal: Signal, raw: NDArray[np.uint64]) -> NDArray[Any]:
    """Raw bits as the number that they stand for."""
    if signal.is_float:
        narrow = {16: np.uint16, 32: np.uint32, 64: np.uint64}[signal.length]
        kind = {16: np.float16, 32: np.float32, 64: np.float64}[signal.length]
        return raw.astype(narrow).view(kind).astype(np.float64)
    return signed_integers(raw, signal.length) if signal.is_signed else raw
