"""Where the fields of each PGN are, and which codes mean "not available": asked of the canboat database.

Names, offsets, lengths, scales and units come from the database that the package ``nmea2000`` carries. It
does not say which fields are signed, which codes are no values, and which values tell the variants of a
proprietary PGN apart; these are found by encoding an empty message and decoding a few probes with the package
itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

from nmea2000 import backend
from nmea2000.native_units import NATIVE_UNITS

from ingest.log import SOURCE

NUMERIC = frozenset({"NUMBER", "MMSI", "PGN", "DURATION", "FIELD_INDEX", "TIME", "DATE", "ADDRESS"})
CODES = frozenset({"LOOKUP", "INDIRECT_LOOKUP", "BITLOOKUP", "DYNAMIC_FIELD_KEY", "DYNAMIC_FIELD_LENGTH"})
#: Where the codes of makers end.
HEAD_BITS = 32
#: A number of more bits is none; a text may be as long as it likes.
MOST_BITS = {"STRING_FIX": 1 << 16, "FLOAT": 32}
#: Field types that become no column: padding, and bytes that mean something only to their maker.
KINDS = {
    **dict.fromkeys(NUMERIC, "number"),
    **dict.fromkeys(CODES, "code"),
    "FLOAT": "float",
    "STRING_FIX": "text",
}


@dataclass(frozen=True)
class Field:
    """One column of a PGN's table.

    Attributes
    ----------
    name : str
        canboat's id; ``source_`` for its ``source``, as ``source`` is the sender's address.
    kind : str
        ``"number"``, ``"code"`` (of a lookup), ``"float"`` or ``"text"``.
    bit, bits : int
        Offset and length in the payload.
    signed : bool
    low, high : int
        Raw integers outside are not values.
    scale, offset : float
        value = raw · scale + offset.
    unit : str
    """

    name: str
    kind: str
    bit: int
    bits: int
    signed: bool = False
    low: int = 0
    high: int = 0
    scale: float = 1.0
    offset: float = 0.0
    unit: str = ""


@dataclass(frozen=True)
class Repeat:
    """Repeated fields: their first repetition, its length in bits, and the field that counts them."""

    fields: tuple[Field, ...]
    bits: int
    counter: str | None


@dataclass(frozen=True)
class Layout:
    """One variant of a PGN.

    Attributes
    ----------
    pgn : int
    name : str
        Of the table: canboat's id, or ``pgn65306`` where canboat knows only the range in which the PGN lies.
    fields : tuple of Field
    repeat : Repeat, optional
    skipped : tuple of str
        Fields that become no column: binary, of variable length, or behind such.
    """

    pgn: int
    name: str
    fields: tuple[Field, ...]
    repeat: Repeat | None = None
    skipped: tuple[str, ...] = ()


@cache
def is_fast(pgn: int) -> bool:
    """Whether a PGN is sent as fast packets."""
    return bool(backend.is_fast_pgn(pgn))


@cache
def variants(pgn: int) -> tuple[str, ...]:
    """Names (canboat's ids) of the definitions of a PGN; () for an unknown PGN."""
    return tuple(info.id for info in backend.DATABASE.pgn_variants(pgn))


@cache
def telling_places(pgn: int) -> tuple[tuple[int, int], ...]:
    """Offset and length of the fields that may tell the variants of a PGN apart.

    These are the fields that an empty message of some variant does not leave not available; where the
    database cannot encode one, the fields at the head of the payload, where makers put their codes.
    """
    places: set[tuple[int, int]] = set()
    for info in backend.DATABASE.pgn_variants(pgn):
        empty = empty_message(info)
        for f in info.fields:
            if f.field_type not in ("NUMBER", "LOOKUP", "PGN") or f.bit_offset is None or not f.bit_length:
                continue
            code = None if empty is None else bits_at(empty, f.bit_offset, f.bit_length)
            if f.bit_offset < HEAD_BITS if empty is None else code not in (None, *blank_codes(f.bit_length)):
                places.add((f.bit_offset, f.bit_length))
    return tuple(sorted(places))


def blank_codes(bits: int) -> tuple[int, int]:
    """Codes for "not available" of an unsigned and of a signed field."""
    return (1 << bits) - 1, (1 << (bits - 1)) - 1


def variant_of(pgn: int, payload: bytes) -> str | None:
    """Name of the definition by which the package decodes a payload; None where there is none."""
    message = backend.decode(pgn, payload)
    return None if message is None else str(message.id)


@cache
def layout(pgn: int, name: str, sample: bytes = b"") -> Layout:
    """The layout of one variant of a PGN.

    Parameters
    ----------
    pgn : int
    name : str
        canboat's id.
    sample : bytes
        A payload of it, to probe with where the database cannot encode an empty one.
    """
    info = backend.DATABASE.pgn_info(name)
    empty = empty_message(info)
    ground = empty or sample
    placed = [f for f in info.fields if f.bit_offset is not None and f.bit_length]
    start, count, counter = repeated_fields(info)
    inside = {f.id for f in info.fields[start : start + count]}
    described = [
        f
        for f in placed
        if KINDS.get(f.field_type or "NUMBER") and f.bit_length <= MOST_BITS.get(f.field_type, 64)
    ]
    fields = {f.id: field_of(pgn, info, f, ground, empty is not None) for f in described}
    skipped = [f.id for f in info.fields if f.id not in fields and f.field_type not in ("RESERVED", "SPARE")]
    return Layout(
        pgn,
        f"pgn{pgn}" if name.startswith("0x") else name,
        tuple(f for key, f in fields.items() if key not in inside),
        repeat_of(info, fields, start, count, counter),
        tuple(skipped),
    )


def empty_message(info: backend.canboat.PgnInfo) -> bytes | None:
    """Payload with every field not available; fields that tell variants apart keep their code."""
    try:
        return bytes(backend.DATABASE.encode(info.id, {}))
    except backend.canboat.EncodeError:
        return None


def repeated_fields(info: backend.canboat.PgnInfo) -> tuple[int, int, str | None]:
    """Index of the first repeated field, their number, and the id of the field that counts them."""
    if len(info.repeating_sets) != 1:
        return len(info.fields), 0, None
    start, count, counter = info.repeating_sets[0]
    return start, count, None if counter is None else info.fields[counter].id


def repeat_of(
    info: backend.canboat.PgnInfo, fields: dict[str, Field], start: int, count: int, counter: str | None
) -> Repeat | None:
    """The repeated group, if every field of it has its place."""
    group = info.fields[start : start + count]
    if not group or any(f.bit_offset is None or not f.bit_length for f in group):
        return None
    bits = sum(f.bit_length for f in group)
    return Repeat(tuple(fields[f.id] for f in group if f.id in fields), bits, counter)


def bits_at(payload: bytes, bit: int, bits: int) -> int | None:
    """Raw integer at a place; None beyond the end."""
    if bit + bits > 8 * len(payload):
        return None
    return int.from_bytes(payload, "little") >> bit & ((1 << bits) - 1)


def field_of(
    pgn: int, info: backend.canboat.PgnInfo, f: backend.canboat.FieldInfo, ground: bytes, is_empty: bool
) -> Field:
    """The column of one field; ``ground`` is a payload to probe with, empty or not."""
    kind = KINDS[f.field_type or "NUMBER"]
    unit, scale, offset = NATIVE_UNITS.get((info.id, f.id)) or (f.unit, f.resolution, f.offset)
    name = f"{f.id}_" if f.id == SOURCE else f.id
    plain = Field(name, kind, f.bit_offset, f.bit_length, unit=unit or "")
    if kind in ("float", "text"):
        return plain
    probe = prober(pgn, info, f, ground)
    empty = bits_at(ground, f.bit_offset, f.bit_length) if is_empty else None
    signed = kind == "number" and is_signed(empty, probe, f.bit_length)
    low, high = limits(probe, f.bit_length, signed, kind)
    coded = replace(plain, signed=signed, low=low, high=high)
    return (
        replace(coded, scale=float(scale or 1.0), offset=float(offset or 0.0)) if kind == "number" else coded
    )


def prober(
    pgn: int, info: backend.canboat.PgnInfo, f: backend.canboat.FieldInfo, ground: bytes
) -> Callable[[int], float | None]:
    """A function that decodes a raw integer as this field."""
    width = max(len(ground), -(-(f.bit_offset + f.bit_length) // 8))
    number = int.from_bytes(ground.ljust(width, b"\xff"), "little")
    mask = (1 << f.bit_length) - 1
    index = [g.id for g in info.fields].index(f.id)

    def decoded(raw: int) -> float | None:
        changed = number & ~(mask << f.bit_offset) | (raw & mask) << f.bit_offset
        message = backend.decode(pgn, changed.to_bytes(width, "little"))
        if message is None or message.id != info.id or len(message.fields) <= index:
            return None
        found = message.fields[index]
        value = found.raw_value if f.field_type in ("TIME", "DATE") else found.value
        if value is None:
            return None
        return float(value) if isinstance(value, (int, float)) else 0.0

    return decoded


def is_signed(empty: int | None, probe: Callable[[int], float | None], bits: int) -> bool:
    """Whether a field is signed: by its code for "not available", or by which codes are smaller values."""
    if bits < 2 or empty == (1 << bits) - 1:
        return False
    if empty == (1 << (bits - 1)) - 1:
        return True
    upper, lower = probe(0b11 << (bits - 2)), probe(0 if bits < 3 else 1 << (bits - 3))
    return upper is not None and lower is not None and upper < lower


def limits(probe: Callable[[int], float | None], bits: int, signed: bool, kind: str) -> tuple[int, int]:
    """Smallest and largest raw integer that is a value."""
    low, high = (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if signed else (0, (1 << bits) - 1)
    if kind == "code":
        return low, high if probe(high) is not None else high - 1
    middle = 1 if probe(1) is not None else 0
    if probe(middle) is None:
        return low, high
    return edge(probe, middle, low), edge(probe, middle, high)


def edge(probe: Callable[[int], float | None], good: int, far: int) -> int:
    """The last raw integer from ``good`` towards ``far`` that is a value; they form one stretch."""
    sign = 1 if far > good else -1
    for k in range(min(5, abs(far - good) + 1)):
        if probe(far - sign * k) is not None:
            return far - sign * k
    bad = far - sign * 4
    while abs(bad - good) > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if probe(middle) is not None else (good, middle)
    return good
