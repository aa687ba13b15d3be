"""Formats and subscriptions of a ULog: from their text to numpy layouts, nested types flattened."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

#: numpy type by ULog type, as pyulog decodes them.
TYPES: Mapping[str, str] = {
    "int8_t": "i1", "uint8_t": "u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4", "uint32_t": "<u4",
    "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8", "bool": "i1", "char": "i1",
}  # fmt: skip
FIELD = re.compile(r"(?P<type>\w+)(?:\[(?P<count>\d+)\])? (?P<name>\w+)")
DEEPEST, MOST_FIELDS = 8, 20_000
PADDING = "_padding"


@dataclass(frozen=True)
class Field:
    """One field of a format: ``count`` is 0 where it is no array."""

    type: str
    count: int
    name: str


@dataclass(frozen=True)
class Subscription:
    """A topic that is logged.

    Attributes
    ----------
    identity : int
        Message id of its data.
    name : str
    instance : int
        Multi id.
    dtype : dtype
        Packed; without padding at the end.
    most : int
        Size with padding at the end.
    """

    identity: int
    name: str
    instance: int
    dtype: np.dtype[Any]
    most: int


def parse_format(body: bytes) -> tuple[str, tuple[Field, ...]] | None:
    """Name and fields of a format message; None where it is not sound."""
    name, colon, rest = body.decode("latin-1").partition(":")
    if not colon or not re.fullmatch(r"[\w/-]+", name):
        return None
    matches = [FIELD.fullmatch(part.strip()) for part in rest.split(";") if part.strip()]
    fields = tuple(Field(m["type"], int(m["count"] or 0), m["name"]) for m in matches if m)
    return (name, fields) if fields and len(fields) == len(matches) else None


def parse_subscription(body: bytes, formats: Mapping[str, tuple[Field, ...]]) -> Subscription | None:
    """Give the subscription of an add-logged message; None where its format is not known or not sound."""
    name = body[3:].decode("latin-1")
    if len(body) < 4 or name not in formats:
        return None
    flat = flatten(name, formats)
    if not flat or len(flat) > MOST_FIELDS or len({n for n, _ in flat}) != len(flat):
        return None
    most = np.dtype(flat).itemsize
    while flat and flat[-1][0].startswith(PADDING):
        flat.pop()
    dtype = np.dtype(flat)
    if dtype.names is None or dtype.names.count("timestamp") != 1 or dtype["timestamp"] != np.dtype("<u8"):
        return None
    return Subscription(int.from_bytes(body[1:3], "little"), name, body[0], dtype, most)


def flatten(
    type_: str, formats: Mapping[str, tuple[Field, ...]], prefix: str = "", depth: int = 0
) -> list[tuple[str, str]]:
    """Names and numpy types of all fields of a type; empty where a type is missing or nested too deeply."""
    out: list[tuple[str, str]] = []
    if depth > DEEPEST:
        return []
    for field in formats.get(type_, ()):
        names = [f"{prefix}{field.name}[{k}]" for k in range(field.count)] or [prefix + field.name]
        if len(out) + len(names) > MOST_FIELDS:
            return []
        for name in names:
            inner = (
                [(name, TYPES[field.type])]
                if field.type in TYPES
                else flatten(field.type, formats, name + ".", depth + 1)
            )
            if not inner:
                return []
            out += inner
    return out
