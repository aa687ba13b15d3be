"""NMEA 2000: frames and packets → one table per PGN, by column.

A table is named by canboat's id of the PGN (``rudder``, ``vesselHeading``, ``cogSogRapidUpdate``), its columns by
canboat's ids of the fields, with the units of canboat.json (rad, m/s, deg for latitude and longitude, rpm for
engine speed). ``source`` is the sender's address. Codes of lookups stay codes. Not-available and out-of-range codes
are NaN, and so are fields beyond the end of a short payload. Repeated fields are columns ``name[0]``, ``name[1]``, ….
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.canbus.fastpacket import assemble
from ingest.canbus.frames import Capture, Frames, Packets
from ingest.canbus.layout import Field, Layout, Repeat, is_fast, is_known, layouts
from ingest.log import SOURCE, Finding

MOST_REPEATS = 32
Wanted = Callable[[int, str], bool]


@dataclass(frozen=True)
class Tables:
    """Decoded tables, their units, what was noticed, and the number of messages."""

    tables: dict[str, pd.DataFrame]
    units: dict[tuple[str, str], str]
    findings: tuple[Finding, ...] = ()
    messages: int = 0


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
        known = layouts(pgn)
        topic = known[0].name if known else str(pgn)
        if lost:
            message = f"{lost} fast packets of PGN {pgn} with a frame missing"
            findings.append(Finding("damaged", message, topic=topic, count=lost))
        decoded = 0
        for layout, rows in by_variant(known, packets):
            decoded += len(rows)
            if wanted(pgn, layout.name):
                tables[layout.name] = table_of(layout, rows)
                units |= {(layout.name, name): unit for name, unit in units_of(layout, tables[layout.name])}
        messages += decoded
        findings += undecoded(pgn, len(packets) - decoded, topic if known else None)
    return Tables(tables, units, tuple(findings), messages)


def undecoded(pgn: int, count: int, topic: str | None) -> Iterator[Finding]:
    """What is said of packets that no layout fits."""
    if count > 0:
        why = "that the canboat database does not know" if topic is None else "of an unknown variant"
        yield Finding("unknown", f"{count} messages of PGN {pgn} {why}", count=count)


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


def by_variant(known: tuple[Layout, ...], packets: Packets) -> Iterator[tuple[Layout, Packets]]:
    """Each variant that occurs, with its packets; the first that fits a packet takes it."""
    if len(known) == 1 and not known[0].match:
        yield known[0], packets
        return
    free = np.ones(len(packets), np.bool_)
    for layout in known:
        fits = free.copy()
        for bit, bits, code in layout.match:
            fits &= (raw_bits(packets.payload, bit, bits) == code) & (packets.length * 8 >= bit + bits)
        if fits.any():
            free &= ~fits
            yield layout, packets.take(fits)


def table_of(layout: Layout, packets: Packets) -> pd.DataFrame:
    """The table of one variant."""
    payload = np.ascontiguousarray(packets.payload.T)
    columns: dict[str, NDArray[np.generic]] = {SOURCE: packets.source.astype(np.int16)}
    columns |= {f.name: column(f, payload, packets.length) for f in layout.fields}
    if layout.repeat is not None:
        columns |= repeated(layout.repeat, payload, packets.length, columns)
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
    missing = length * 8 < bit + f.bits
    if f.kind == "float":
        values = raw.astype(np.uint32).view(np.float32).astype(np.float64)
    else:
        number = signed_integers(raw, f.bits) if f.signed else raw
        values = number * f.scale + f.offset
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
    texts = [bytes(t).split(b"\xff")[0].split(b"\0")[0].decode("latin-1").rstrip(" @") for t in distinct]
    return np.array(texts, dtype=object)[inverse]


def units_of(layout: Layout, table: pd.DataFrame) -> Iterator[tuple[str, str]]:
    """Column and unit, for the columns that have one."""
    units = {f.name: f.unit for f in layout.fields}
    if layout.repeat is not None:
        units |= {f.name: f.unit for f in layout.repeat.fields}
    for name in table.columns:
        unit = units.get(str(name).partition("[")[0])
        if unit:
            yield str(name), unit


def known_share(frames: Frames) -> float:
    """Share of the frames whose PGN the database knows."""
    if not len(frames):
        return 0.0
    numbers, counts = np.unique(pgn_of(frames.can_id[frames.extended]), return_counts=True)
    return float(
        sum(c for n, c in zip(numbers.tolist(), counts.tolist(), strict=True) if is_known(n)) / len(frames)
    )
