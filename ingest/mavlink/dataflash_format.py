"""What FMT, FMTU, UNIT and MULT records say about the others: layout, scale, units, instances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ingest.mavlink.columns import terminated

#: numpy type of each format character.
TYPES: Mapping[str, Any] = {
    "a": ("<i2", (32,)), "b": "i1", "B": "u1", "g": "<f2", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4",
    "f": "<f4",
    "n": "S4", "N": "S16", "Z": "S64", "c": "<i2", "C": "<u2", "e": "<i4", "E": "<u4", "L": "<i4", "d": "<f8",
    "M": "u1", "q": "<i8", "Q": "<u8",
}  # fmt: skip
#: Dividing by a power of ten is more exact than multiplying by its inverse.
DIVISORS: Mapping[str, float] = {"c": 1e2, "C": 1e2, "e": 1e2, "E": 1e2, "L": 1e7}
PREFIXES: Mapping[float, str] = {0.0: "", 1.0: "", 1e-1: "d", 1e-2: "c", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}
FMT_DTYPE = np.dtype(
    [("type", "u1"), ("length", "u1"), ("name", "S4"), ("format", "S16"), ("columns", "S64")]
)


@dataclass(frozen=True)
class Format:
    """Layout of one type of record.

    Attributes
    ----------
    kind : int
        Type.
    name : str
    letters : str
        Format characters.
    columns : tuple of str
    units : tuple of str
        Unit of each column, empty where it is not stated.
    instance : str, optional
        The column that tells instances apart.
    """

    kind: int
    name: str
    letters: str
    columns: tuple[str, ...]
    units: tuple[str, ...] = ()
    instance: str | None = None
    dtype: np.dtype[Any] = field(init=False)

    def __post_init__(self) -> None:
        layout = [(c, TYPES[x]) for c, x in zip(self.columns, self.letters, strict=True)]
        object.__setattr__(self, "dtype", np.dtype(layout))

    @property
    def time_width(self) -> int:
        """Bytes of the time in the first column: 8 for TimeUS, 4 for TimeMS, 0 where there is none."""
        first = (self.columns[0], self.letters[0]) if self.columns else ("", "")
        return {("TimeUS", "Q"): 8, ("TimeUS", "q"): 8, ("TimeMS", "I"): 4}.get(first, 0)


def parse_format(record: np.void) -> Format | None:
    """Give the format that an FMT record defines; None where it is not sound."""
    letters = text(record["format"])
    columns = [c.strip() for c in text(record["columns"]).split(",")]
    name = text(record["name"])
    if not letters or not name or any(x not in TYPES for x in letters):
        return None
    columns = unique((columns + [f"field{k}" for k in range(len(columns), len(letters))])[: len(letters)])
    return Format(int(record["type"]), name, letters, tuple(columns))


def unique(names: list[str]) -> list[str]:
    """Give the names, with a number behind those that are empty or come again."""
    out: list[str] = []
    for k, name in enumerate(names):
        out.append(name if name and name not in out else f"{name}_{k}")
    return out


def text(raw: bytes) -> str:
    """Characters before the first zero."""
    return terminated(bytes(raw))


@dataclass(frozen=True)
class Meanings:
    """What UNIT, MULT and FMTU say.

    Attributes
    ----------
    units : mapping of int to str
        Label by identifier.
    multipliers : mapping of int to float
    by_kind : mapping of int to (str, str)
        Unit and multiplier identifiers of the columns, by type.
    """

    units: Mapping[int, str]
    multipliers: Mapping[int, float]
    by_kind: Mapping[int, tuple[str, str]]


def with_meaning(layout: Format, meanings: Meanings) -> Format:
    """Give the format with its units, and the column of its instances."""
    unit_ids, multiplier_ids = meanings.by_kind.get(layout.kind, ("", ""))
    units = tuple(
        unit_of(layout.letters[k], unit_ids[k : k + 1], multiplier_ids[k : k + 1], meanings)
        for k in range(len(layout.columns))
    )
    marked = unit_ids.find("#")
    instance = layout.columns[marked] if 0 <= marked < len(layout.columns) else None
    if not unit_ids and layout.columns[1:2] == ("I",) and layout.letters[1] == "B":
        instance = "I"
    return Format(layout.kind, layout.name, layout.letters, layout.columns, units, instance)


def unit_of(letter: str, unit_id: str, multiplier_id: str, meanings: Meanings) -> str:
    """Give the unit of a column as decoded: the multiplier as a prefix, unless the letter scales it."""
    unit = meanings.units.get(ord(unit_id), "") if unit_id else ""
    multiplier = meanings.multipliers.get(ord(multiplier_id)) if multiplier_id else None
    if not unit or letter in DIVISORS or multiplier is None:
        return unit
    prefix = PREFIXES.get(multiplier)
    return f"{multiplier:.4g} {unit}" if prefix is None else prefix + unit


def scaled(values: NDArray[Any], letter: str) -> NDArray[Any]:
    """Values in the unit of their column."""
    return values / DIVISORS[letter] if letter in DIVISORS else values
