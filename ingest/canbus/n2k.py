"""NMEA 2000: frames and packets → one table per PGN, by column.

A table is named by canboat's id of the PGN (``rudder``, ``vesselHeading``, ``cogSogRapidUpdate``), its
columns by canboat's ids of the fields, with the units of canboat.json (rad, m/s, deg for latitude and
longitude, rpm for engine speed). ``source`` is the sender's address (canboat's own field ``source`` is
``source_``). Codes of lookups stay codes. Not-available and out-of-range codes are NaN, and so are fields
beyond the end of a short payload. Repeated fields are columns ``name[0]``, ``name[1]``, ….
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.canbus.fastpacket import assemble
from ingest.canbus.frames import Capture, Frames, Packets
from ingest.canbus.layout import Field, Layout, Repeat, is_fast, layout, telling_places, variant_of, variants
from ingest.log import SOURCE, Finding

MOST_REPEATS = 32
Wanted = Callable[[int, str], bool]


@dataclass(frozen=True)
class Tables:
    """Decoded tables, their units, what was noticed, the number of messages, and who sends them, where that is said."""

    tables: dict[str, pd.DataFrame]
    units: dict[tuple[str, str], str]
    findings: tuple[Finding, ...] = ()
    messages: int = 0
    senders: Mapping[str, str] = field(default_factory=dict)


def decode(capture: Capture, wanted: Wanted) -> Tables:
    """Tables of every PGN that the database knows.

    Parameters
    ----------
    capture : Capture
    wanted : callable
        ``wanted(pgn, name)``: whether to decode a PGN's variant.
    """
    tables: dict[str, pd.DataFrame] = {}
    units: dict[tuple[str, str], str] = {}
    findings: list[Finding] = []
    messages = 0
    for pgn, packets, lost in packets_by_pgn(capture):
        if lost:
            message = f"{lost} fast packets of PGN {pgn} with a frame missing"
            findings.append(Finding("gap", message, topic=next(iter(variants(pgn)), None), count=lost))
        decoded = 0
        for name, rows in by_variant(pgn, packets):
            decoded += len(rows)
            found = layout(pgn, name, sample_of(rows))
            if wanted(pgn, found.name):
                tables[found.name] = table_of(found, rows)
                units |= {(found.name, column): unit for column, unit in units_of(found, tables[found.name])}
        messages += decoded
        findings += undecoded(pgn, len(packets) - decoded)
    return Tables(tables, units, tuple(findings), messages)


def undecoded(pgn: int, count: int) -> Iterator[Finding]:
    """What is said of packets that the database does not describe."""
    if count > 0:
        message = f"{count} messages of PGN {pgn}, which the canboat database does not know"
        yield Finding("unknown", message, count=count)


def sample_of(packets: Packets) -> bytes:
    """One payload, the longest."""
    i = int(np.argmax(packets.length))
    return bytes(packets.payload[i, : packets.length[i]])


def packets_by_pgn(capture: Capture) -> Iterator[tuple[int, Packets, int]]:
    """PGN, its packets, and the number of those that were lost to a missing frame."""
    frames = capture.frames
    frames = frames if frames.extended.all() else frames.take(frames.extended)
    numbers = pgn_of(frames.can_id)
    order = np.argsort(numbers, kind="stable")
    edges = np.flatnonzero(np.diff(numbers[order])) + 1
    loose = {int(numbers[rows[0]]): rows for rows in np.split(order, edges) if len(rows)}
    for pgn in sorted(loose.keys() | capture.packets.keys()):
        given = capture.packets.get(pgn)
        if pgn not in loose:
            if given is not None:
                yield pgn, given, 0
            continue
        packets, lost = packets_of(pgn, frames.take(loose[pgn]))
        yield pgn, packets if given is None else together(packets, given), lost


def pgn_of(can_id: NDArray[np.uint32]) -> NDArray[np.int64]:
    """PGN of 29-bit identifiers; an addressed one (PDU1) without its addressee; (n,)."""
    numbers = (can_id.astype(np.int64) >> 8) & 0x3FFFF
    return np.where((numbers >> 8 & 0xFF) < 240, numbers & 0x3FF00, numbers)


def packets_of(pgn: int, frames: Frames) -> tuple[Packets, int]:
    """The packets of one PGN's frames, and the number lost."""
    if is_fast(pgn):
        return assemble(frames)
    source = (frames.can_id & 0xFF).astype(np.uint8)
    return Packets(frames.time_ns, source, frames.dlc.astype(np.int64), frames.data), 0


def together(a: Packets, b: Packets) -> Packets:
    """Packets of both, in order of time."""
    width = max(a.payload.shape[1], b.payload.shape[1])
    payloads = [np.pad(p.payload, ((0, 0), (0, width - p.payload.shape[1]))) for p in (a, b)]
    joined = Packets(
        np.concatenate([a.time_ns, b.time_ns]),
        np.concatenate([a.source, b.source]),
        np.concatenate([a.length, b.length]),
        np.concatenate(payloads),
    )
    return joined.take(np.argsort(joined.time_ns, kind="stable"))


def by_variant(pgn: int, packets: Packets) -> Iterator[tuple[str, Packets]]:
    """Each variant of a PGN that occurs, with its packets.

    Packets that agree in all fields that may tell variants apart are of one variant: the package is asked
    for it once per combination of these fields.
    """
    names, places = variants(pgn), telling_places(pgn)
    if not names or not len(packets):
        return
    if len(names) == 1 and not places:
        yield names[0], packets
        return
    first, group = combinations(packets, places)
    given = [variant_of(pgn, bytes(packets.payload[i, : packets.length[i]])) for i in first.tolist()]
    for name in dict.fromkeys(n for n in given if n is not None):
        mine = np.array([n == name for n in given], np.bool_)[group]
        yield name, packets if mine.all() else packets.take(mine)


def combinations(
    packets: Packets, places: tuple[tuple[int, int], ...]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Index of the first packet of each combination of field values, and each packet's combination; (n,)."""
    reach = max((bit + bits + 7) // 8 for bit, bits in places) if places else 1
    key = np.minimum(packets.length, reach).astype(np.uint64)
    for bit, bits in places:
        key = key * np.uint64(0x9E3779B97F4A7C15) ^ raw_bits(packets.payload, bit, bits)
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    return first.astype(np.int64), group.astype(np.int64)


def table_of(definition: Layout, packets: Packets) -> pd.DataFrame:
    """The table of one variant."""
    payload = np.ascontiguousarray(packets.payload.T)
    columns: dict[str, NDArray[np.generic]] = {SOURCE: packets.source.astype(np.int16)}
    columns |= {f.name: column(f, payload, packets.length) for f in definition.fields}
    if definition.repeat is not None:
        columns |= repeated(definition.repeat, payload, packets.length, columns)
    return pd.DataFrame(columns, index=pd.Index(packets.time_ns, name="t_ns"), copy=False)


def repeated(
    repeat: Repeat,
    payload: NDArray[np.uint8],
    length: NDArray[np.int64],
    columns: dict[str, NDArray[np.generic]],
) -> dict[str, NDArray[np.generic]]:
    """Columns of the repeated fields, as far as the longest payload and the counter reach."""
    if not repeat.fields:
        return {}
    start = min(f.bit for f in repeat.fields)
    room = max((8 * int(length.max(initial=0)) - start) // repeat.bits, 0)
    counted = columns.get(repeat.counter or "")
    sets = np.full(len(length), room) if counted is None else np.nan_to_num(counted.astype(np.float64))
    out: dict[str, NDArray[np.generic]] = {}
    for k in range(min(room, MOST_REPEATS, int(sets.max(initial=0)))):
        there = np.where(sets > k, length, 0)
        for f in repeat.fields:
            out[f"{f.name}[{k}]"] = column(f, payload, there, k * repeat.bits)
    return out


def column(
    f: Field, payload: NDArray[np.uint8], length: NDArray[np.int64], shift: int = 0
) -> NDArray[np.generic]:
    """Values of one field; ``payload`` is (bytes, n)."""
    bit = f.bit + shift
    if f.kind == "text":
        return text_column(payload[bit // 8 : (bit + f.bits) // 8])
    raw = raw_bits(payload.T, bit, f.bits)
    values: NDArray[np.float64]
    missing = length * 8 < bit + f.bits
    if f.kind == "float":
        with np.errstate(invalid="ignore"):  # NaNs may be signalling ones
            values = raw.astype(np.uint32).view(np.float32).astype(np.float64)
    else:
        number = signed_integers(raw, f.bits) if f.signed else raw
        values = np.asarray(number * f.scale + f.offset, np.float64)
        missing |= (number < f.low) | (number > f.high)
    values[missing] = np.nan
    return values


def raw_bits(payload: NDArray[np.uint8], bit: int, bits: int) -> NDArray[np.uint64]:
    """Unsigned integer of up to 64 bits at a place of each payload, least significant byte first; (n,).

    Bytes beyond the end of the payload are 0.
    """
    raw = np.zeros(len(payload), np.uint64)
    first, last = bit // 8, min((bit + bits + 7) // 8, payload.shape[1])
    for k in range(first, last):
        byte = payload[:, k].astype(np.uint64)
        place = 8 * k - bit
        raw |= byte << np.uint64(place) if place >= 0 else byte >> np.uint64(-place)
    return raw & np.uint64((1 << bits) - 1)


def signed_integers(raw: NDArray[np.uint64], bits: int) -> NDArray[np.int64]:
    """Two's complement of ``bits`` bits."""
    up = np.uint64(64 - bits)
    return (raw << up).view(np.int64) >> np.int64(64 - bits)


def text_column(payload: NDArray[np.uint8]) -> NDArray[np.generic]:
    """Text of a fixed length, without its padding."""
    width, count = payload.shape
    if not width:
        return np.full(count, "", dtype=object)
    block = np.ascontiguousarray(payload.T).view(f"S{width}").ravel()
    distinct, inverse = np.unique(block, return_inverse=True)
    texts = [plain_text(bytes(t)) for t in distinct]
    return np.array(texts, dtype=object)[inverse]


def plain_text(field: bytes) -> str:
    """The text in a field: up to a NUL, without padding; UTF-8 or else Latin-1."""
    text = field.partition(b"\0")[0].rstrip(b"\xff @")
    try:
        return text.decode()
    except UnicodeDecodeError:
        return text.decode("latin-1")


def units_of(definition: Layout, table: pd.DataFrame) -> Iterator[tuple[str, str]]:
    """Column and unit, for the columns that have one."""
    units = {f.name: f.unit for f in definition.fields}
    if definition.repeat is not None:
        units |= {f.name: f.unit for f in definition.repeat.fields}
    for name in table.columns:
        unit = units.get(str(name).partition("[")[0])
        if unit:
            yield str(name), unit
