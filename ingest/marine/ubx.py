"""u-blox UBX frames to columns; layouts come from pyubx2's payload definitions."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.compiled import compiled
from ingest.marine.scan import UBX, UBX_OVERHEAD, Bytes, Records

Integers = NDArray[np.int64]
PAYLOAD = 6

#: Families of messages that are decoded, and those of them that list satellites.
FAMILIES = ("NAV-", "NAV2-", "ESF-", "HNR-", "TIM-")
SATELLITES = ("SAT", "SIG", "SBAS", "ORB", "SVINFO", "SLAS", "DGPS", "EKFSTATUS")

_INTEGERS = {
    ("U", 1): "u1", ("U", 2): "<u2", ("U", 4): "<u4", ("U", 8): "<u8", ("E", 1): "u1", ("E", 2): "<u2",
    ("I", 1): "i1", ("I", 2): "<i2", ("I", 4): "<i4", ("I", 8): "<i8", ("X", 1): "u1", ("X", 2): "<u2",
    ("X", 4): "<u4", ("X", 8): "<u8", ("R", 4): "<f4", ("R", 8): "<f8", ("L", 1): "u1",
}  # fmt: skip


@dataclass(frozen=True)
class Column:
    """One column of a message.

    Attributes
    ----------
    name : str
        As pyubx2 names it.
    offset, size : int
        Bytes in the payload.
    dtype : str
        Of the bytes.
    scale : float
        Of the number.
    shift, width : int
        Bits, for a part of a bit field (``width`` 0: the whole number).
    """

    name: str
    offset: int
    size: int
    dtype: str
    scale: float = 1.0
    shift: int = 0
    width: int = 0


@dataclass(frozen=True)
class Messages:
    """All messages of one kind: index of each among the records of the stream, and their table."""

    record: Integers
    table: pd.DataFrame


def message_rows(data: Bytes, records: Records, topics: frozenset[str] | None = None) -> dict[str, Messages]:
    """Decode every UBX message of a stream whose kind is known.

    Parameters
    ----------
    data : (n,) uint8
        The stream.
    records : Records
        What ``scan`` found in it.
    topics : set of str, optional
        Decode only these, and ``NAV-PVT``, which has the time.
    """
    chosen = np.flatnonzero(records.kind == UBX)
    start, size = records.start[chosen], (records.end - records.start)[chosen] - UBX_OVERHEAD
    code = (data[start + 2].astype(np.int64) << 8) | data[start + 3]
    result: dict[str, Messages] = {}
    for key in np.unique(code):
        topic, payload = definition(int(key))
        if not payload or (topics is not None and topic not in topics | {"NAV-PVT"}):
            continue
        mine = np.flatnonzero(code == key)
        parts = []
        for length in np.unique(size[mine]):
            rows = mine[size[mine] == length]
            table = decode(data, start[rows] + PAYLOAD, int(length), topic)
            parts.append(Messages(chosen[rows], table))
        result[topic] = _join(parts)
    return result


def _join(parts: list[Messages]) -> Messages:
    if len(parts) == 1:
        return parts[0]
    record = np.concatenate([p.record for p in parts])
    order = np.argsort(record, kind="stable")
    table = pd.concat([p.table for p in parts], ignore_index=True)
    return Messages(record[order], table.iloc[order].reset_index(drop=True))


def definition(code: int) -> tuple[str, Mapping[str, object]]:
    """Name and payload definition of a message by class and number; empty where it is not decoded."""
    from pyubx2.ubxtypes_core import UBX_MSGIDS
    from pyubx2.ubxtypes_get import UBX_PAYLOADS_GET

    name = str(UBX_MSGIDS.get(bytes((code >> 8, code & 255)), ""))
    if not name.startswith(FAMILIES) or name.split("-")[-1] in SATELLITES:
        return name, {}
    return name, UBX_PAYLOADS_GET.get(name, {})


def decode(data: Bytes, start: Integers, length: int, topic: str) -> pd.DataFrame:
    """Columns of the messages of one kind and length whose payloads begin at ``start``."""
    block = np.empty((len(start), length), np.uint8)
    _gather(data, start, block)
    columns: dict[str, NDArray[Any]] = {}
    for column in layout(topic, length):
        values = _values(block, column)
        if column.name.startswith("_HP"):
            base = column.name[3:]
            columns[base] = np.round(columns[base] + values, 12)
        else:
            columns[column.name] = values
    return pd.DataFrame(_with_gyro(columns) if topic == "ESF-MEAS" else columns)


def _values(block: Bytes, column: Column) -> NDArray[Any]:
    raw = np.ascontiguousarray(block[:, column.offset : column.offset + column.size])
    values: NDArray[Any] = raw.view(column.dtype).ravel()
    if column.width:
        values = (
            (values.astype(np.uint64) >> np.uint64(column.shift)) & np.uint64((1 << column.width) - 1)
        ).astype(np.uint8 if column.width <= 8 else np.uint32)
    if column.scale == 1.0:
        return values
    inverse = round(1.0 / column.scale)
    exact = abs(inverse * column.scale - 1.0) < 1e-12
    return np.asarray(values / inverse if exact else values * column.scale)


@compiled
def _gather(data: Bytes, start: Integers, block: Bytes) -> None:
    for i in range(block.shape[0]):
        for k in range(block.shape[1]):
            block[i, k] = data[start[i] + k]


@functools.lru_cache(maxsize=256)
def layout(topic: str, length: int) -> tuple[Column, ...]:
    """Columns of a message of so many bytes; repeated groups get ``_01``, ``_02``, …, reserved ones none."""
    from pyubx2.ubxtypes_get import UBX_PAYLOADS_GET

    older = f"{topic}-V0"
    name = older if older in UBX_PAYLOADS_GET and length <= _size(UBX_PAYLOADS_GET[older]) else topic
    return tuple(_columns(UBX_PAYLOADS_GET[name], length))


def _columns(payload: Mapping[str, object], length: int) -> Iterator[Column]:
    offset = 0
    for name, kind in payload.items():
        if name.endswith("_grp") and isinstance(kind, tuple):
            often, group = kind
            size = _size(group)
            repeats = often if isinstance(often, int) else (length - offset) // max(1, size)
            for i in range(repeats):
                for column in _columns(group, size):
                    yield replace(column, name=f"{column.name}_{i + 1:02d}", offset=offset + column.offset)
                offset += size
            continue
        for column in _field(name, kind, offset):
            if offset + column.size <= length:
                yield column
        offset += _width(kind)


def _field(name: str, kind: object, offset: int) -> Iterator[Column]:
    scale = 1.0
    if isinstance(kind, tuple) and isinstance(kind[1], dict):
        yield from _bits(kind, offset)
        return
    if isinstance(kind, tuple):
        kind, scale = kind
    size = _width(kind)
    dtype = _INTEGERS.get((str(kind)[0], size))
    if dtype and not name.startswith("reserved"):
        yield Column(name, offset, size, dtype, float(scale))


def _bits(kind: tuple[object, ...], offset: int) -> Iterator[Column]:
    size, shift = _width(kind), 0
    dtype = _INTEGERS.get(("X", size))
    members = kind[1]
    if dtype is None or not isinstance(members, dict):
        return
    for name, what in members.items():
        scale = 1.0
        if isinstance(what, tuple):
            what, scale = what
        width = int(str(what)[1:])
        if not name.startswith("reserved"):
            yield Column(name, offset, size, dtype, float(scale), shift, width)
        shift += width


def _width(kind: object) -> int:
    """Bytes of a field."""
    if isinstance(kind, tuple):
        kind = kind[0]
    return int(str(kind)[1:]) if str(kind)[1:].isdigit() else 0


def _size(group: Mapping[str, object]) -> int:
    return sum(_width(kind) for kind in group.values())


def _with_gyro(columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Add the rates and accelerations that ``ESF-MEAS`` packs as typed 24-bit numbers.

    u-blox F9 interface description, ESF-MEAS: types 14, 13, 5 are gyroscope x, y, z in 2⁻¹² deg/s; 16, 17, 18
    accelerometer x, y, z in 2⁻¹⁰ m/s².
    """
    kinds = {
        14: ("gyroX", 12),
        13: ("gyroY", 12),
        5: ("gyroZ", 12),
        16: ("accX", 10),
        17: ("accY", 10),
        18: ("accZ", 10),
    }
    for name in [n for n in columns if n.startswith("dataType_")]:
        which = columns[name]
        field = columns[name.replace("Type", "Field")].astype(np.int64)
        signed = np.where(field >= 1 << 23, field - (1 << 24), field)
        for kind in np.intersect1d(np.unique(which), list(kinds)):
            label, power = kinds[int(kind)]
            column = columns.setdefault(label, np.full(len(which), np.nan))
            column[which == kind] = signed[which == kind] / 2.0**power
    return columns
