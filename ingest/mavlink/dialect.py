"""Message layouts, names, units and checksum seeds, taken from the dialects that pymavlink generates."""

from __future__ import annotations

import functools
import importlib
import pkgutil
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ingest.errors import UsageError, nearest

DEFAULT = "ardupilotmega"
PACKAGE = "pymavlink.dialects.v20"
CODES = {
    "b": "i1",
    "B": "u1",
    "h": "<i2",
    "H": "<u2",
    "i": "<i4",
    "I": "<u4",
    "q": "<i8",
    "Q": "<u8",
    "f": "<f4",
    "d": "<f8",
}
#: In the XML: a code that stands for "not available", whole or for each element of an array.
INVALID_MAX = re.compile(r"\[?(U?INT(?:8|16|32|64)_MAX)\]?")


@dataclass(frozen=True)
class MessageType:
    """One type of message.

    Attributes
    ----------
    name : str
    number : int
        Message id.
    dtype : dtype
        Structured, packed, in the order on the wire.
    fields : tuple of str
        In the order of the definition.
    units : mapping of str to str
    invalid : mapping of str to int
        The code of a field that stands for "not available".
    """

    name: str
    number: int
    dtype: np.dtype[Any]
    fields: tuple[str, ...]
    units: Mapping[str, str]
    invalid: Mapping[str, int]


@dataclass(frozen=True)
class Dialect:
    """All types of messages of a dialect.

    Attributes
    ----------
    name : str
    types : tuple of MessageType
    index : (max id + 1,) int16
        Position in ``types`` by message id, −1 where the id is not known.
    crc_extra : (len(types),) uint8
    """

    name: str
    types: tuple[MessageType, ...]
    index: NDArray[np.int16]
    crc_extra: NDArray[np.uint8]


@functools.lru_cache(maxsize=8)
def load_dialect(name: str = DEFAULT) -> Dialect:
    """Load a dialect by its name.

    Raises
    ------
    UsageError
        If pymavlink has no such dialect; with the nearest names.
    """
    if name not in dialect_names():
        near = ", ".join(nearest(name, dialect_names())) or ", ".join(dialect_names())
        raise UsageError(f"dialect.mavlink: expected a MAVLink dialect, found '{name}'. Nearest: {near}.")
    module = importlib.import_module(f"{PACKAGE}.{name}")
    classes = [module.mavlink_map[i] for i in sorted(module.mavlink_map)]
    invalid = invalid_codes(Path(str(module.__file__)).with_suffix(".xml"))
    index = np.full(int(classes[-1].id) + 1, -1, dtype=np.int16)
    index[[int(c.id) for c in classes]] = np.arange(len(classes))
    types = tuple(message_type(c, invalid.get(c.msgname, {})) for c in classes)
    return Dialect(name, types, index, np.array([c.crc_extra for c in classes], dtype=np.uint8))


@functools.cache
def dialect_names() -> tuple[str, ...]:
    """Names of the dialects that pymavlink ships."""
    package: ModuleType = importlib.import_module(PACKAGE)
    return tuple(m.name for m in pkgutil.iter_modules(package.__path__))


def message_type(generated: Any, invalid: Mapping[str, str]) -> MessageType:
    """Describe a generated message class."""
    letters = bytes(generated.native_format).decode().lstrip("<")
    names = list(generated.ordered_fieldnames)
    layout = [field_layout(n, c, k) for n, c, k in zip(names, letters, generated.array_lengths, strict=True)]
    units = {k: str(v) for k, v in generated.fieldunits_by_name.items()}
    dtype = np.dtype(layout)
    codes = {f: code for f, text in invalid.items() if (code := greatest(dtype, f, text)) is not None}
    return MessageType(generated.msgname, int(generated.id), dtype, tuple(generated.fieldnames), units, codes)


def field_layout(name: str, letter: str, length: int) -> tuple[str, str] | tuple[str, str, tuple[int, ...]]:
    """One field of a structured dtype."""
    if letter == "c":
        return name, f"S{max(length, 1)}"
    return (name, CODES[letter], (length,)) if length else (name, CODES[letter])


def greatest(dtype: np.dtype[Any], field: str, text: str) -> int | None:
    """Give the greatest value of a field, if the XML says that it means "not available"."""
    match = INVALID_MAX.fullmatch(text)
    base = dtype[field].base if match and field in (dtype.names or ()) else None
    if match is None or base is None or base.kind not in "iu":
        return None
    code = int(np.iinfo(match[1].removesuffix("_MAX").lower()).max)
    return code if code <= np.iinfo(base).max else None


def invalid_codes(xml: Path) -> dict[str, dict[str, str]]:
    """Collect the ``invalid`` attributes of a dialect's XML, if it is there, and of those it includes."""
    out: dict[str, dict[str, str]] = {}
    todo, done = [xml], set()
    while todo:
        path = todo.pop()
        if path in done or not path.is_file():
            continue
        done.add(path)
        root = ElementTree.parse(path).getroot()
        todo += [path.parent / str(include.text) for include in root.iter("include")]
        for message in root.iter("message"):
            codes = {
                f.get("name", ""): f.get("invalid", "") for f in message.iter("field") if f.get("invalid")
            }
            if codes:
                out[message.get("name", "")] = codes
    return out
