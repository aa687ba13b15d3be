"""Where the fields of each PGN are, and which codes mean "not available": asked of the canboat database.

Names, offsets, lengths, scales and units come from the database that the package ``nmea2000`` carries. It does not
say which fields are signed, which codes are no values, and which values tell the variants of a proprietary PGN
apart; these are found by encoding an empty message and decoding a few probes with the package itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from nmea2000 import backend
from nmea2000.native_units import NATIVE_UNITS

from ingest.log import SOURCE

NUMERIC = frozenset({"NUMBER", "MMSI", "PGN", "DURATION", "FIELD_INDEX", "TIME", "DATE", "ADDRESS"})
CODES = frozenset({"LOOKUP", "INDIRECT_LOOKUP", "BITLOOKUP", "DYNAMIC_FIELD_KEY", "DYNAMIC_FIELD_LENGTH"})
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
    """A group of fields that is repeated: its first repetition, its length in bits, and the field that counts it."""

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
        canboat's id: the name of the table.
    fields : tuple of Field
    match : tuple of (bit, bits, code)
        What tells it from other variants.
    repeat : Repeat, optional
    skipped : tuple of str
        Fields that become no column: binary, of variable length, or behind such.
    """

    pgn: int
    name: str
    fields: tuple[Field, ...]
    match: tuple[tuple[int, int, int], ...] = ()
    repeat: Repeat | None = None
    skipped: tuple[str, ...] = ()


@cache
def is_fast(pgn: int) -> bool:
    """Whether a PGN is sent as fast packets."""
    return bool(backend.is_fast_pgn(pgn))


@cache
def is_known(pgn: int) -> bool:
    """Whether the database knows a PGN."""
    return bool(backend.DATABASE.pgn_variants(pgn))


@cache
def layouts(pgn: int) -> tuple[Layout, ...]:
    """The variants of a PGN, in the order in which canboat tries them; () for an unknown PGN."""
    return tuple(
        layout for info in backend.DATABASE.pgn_variants(pgn) if (layout := layout_of(info)) is not None
    )


def layout_of(info: backend.canboat.PgnInfo) -> Layout | None:
    """The layout of one variant; None where the database cannot encode it, so that nothing tells it apart."""
    empty = empty_message(info)
    if empty is None:
        return None
    placed = [f for f in info.fields if f.bit_offset is not None and f.bit_length]
    start, count, counter = repeated_fields(info)
    inside = {f.id for f in info.fields[start : start + count]}
    fields = {f.id: field_of(info, f, empty) for f in placed if KINDS.get(f.field_type or "NUMBER")}
    fixed = tuple(f for name, f in fields.items() if name not in inside)
    skipped = [f.id for f in info.fields if f.id not in fields and f.field_type not in ("RESERVED", "SPARE")]
    return Layout(
        info.pgn,
        info.id,
        fixed,
        tuple(match_of(placed, inside | {counter or ""}, empty)),
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
    """Index of the first repeated field, their number, and the id of the field that counts the repetitions."""
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


def match_of(
    placed: list[backend.canboat.FieldInfo], apart: set[str], empty: bytes
) -> list[tuple[int, int, int]]:
    """Place and code of each field that an empty message does not leave not available."""
    out = []
    for f in placed:
        code = bits_at(empty, f.bit_offset, f.bit_length)
        blank = code in ((1 << f.bit_length) - 1, (1 << (f.bit_length - 1)) - 1)
        if (
            f.field_type in ("NUMBER", "LOOKUP", "PGN")
            and f.id not in apart
            and code is not None
            and not blank
        ):
            out.append((f.bit_offset, f.bit_length, code))
    return out


def bits_at(payload: bytes, bit: int, bits: int) -> int | None:
    """Raw integer at a place; None beyond the end."""
    if bit + bits > 8 * len(payload):
        return None
    return int.from_bytes(payload, "little") >> bit & ((1 << bits) - 1)


def field_of(info: backend.canboat.PgnInfo, f: backend.canboat.FieldInfo, empty: bytes) -> Field:
    """The column of one field."""
    kind = KINDS[f.field_type or "NUMBER"]
    native = NATIVE_UNITS.get((info.id, f.id))
    unit, scale, offset = native or (f.unit, f.resolution, f.offset)
    name = f"{f.id}_" if f.id == SOURCE else f.id
    plain = Field(name, kind, f.bit_offset, f.bit_length, unit=unit or "")
    if kind in ("float", "text") or f.bit_length > 64:
        return plain
    probe = prober(info, f, empty)
    signed = kind == "number" and is_signed(bits_at(empty, f.bit_offset, f.bit_length), probe, f.bit_length)
    low, high = limits(probe, f.bit_length, signed, kind)
    return Field(
        name,
        kind,
        f.bit_offset,
        f.bit_length,
        signed,
        low,
        high,
        float(scale or 1.0) if kind == "number" else 1.0,
        float(offset or 0.0) if kind == "number" else 0.0,
        unit or "",
    )


def prober(
    info: backend.canboat.PgnInfo, f: backend.canboat.FieldInfo, empty: bytes
) -> Callable[[int], float | None]:
    """A function that decodes a raw integer as this field."""
    width = max(len(empty), -(-(f.bit_offset + f.bit_length) // 8))
    ground = int.from_bytes(empty.ljust(width, b"\xff"), "little")
    mask = (1 << f.bit_length) - 1
    index = [g.id for g in info.fields].index(f.id)

    def decoded(raw: int) -> float | None:
        number = ground & ~(mask << f.bit_offset) | (raw & mask) << f.bit_offset
        message = backend.decode(info.pgn, number.to_bytes(width, "little"))
        if message is None or message.id != info.id or len(message.fields) <= index:
            return None
        found = message.fields[index]
        number_or_text = found.raw_value if f.field_type in ("TIME", "DATE") else found.value
        if number_or_text is None:
            return None
        return float(number_or_text) if isinstance(number_or_text, (int, float)) else 0.0

    return decoded


def is_signed(empty: int | None, probe: Callable[[int], float | None], bits: int) -> bool:
    """Whether a field is signed: by its code for "not available", or else by which codes are the smaller values."""
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
