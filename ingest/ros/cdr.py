"""CDR, the wire format of ROS 2: all messages of a type at once, by a compiled walk over its definition."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.compiled import compiled
from ingest.marine.fields import texts
from ingest.ros.program import (
    END,
    F4,
    F8,
    I1,
    I2,
    I4,
    LOOP,
    SCALAR,
    SIZES,
    TEXT,
    U1,
    U2,
    U4,
    Definitions,
    Program,
    build,
)

Integers = NDArray[np.int64]
Bytes = NDArray[np.uint8]
#: The eight bytes of a number, seen as each type.
Views = tuple[NDArray[Any], ...]
DEPTH = 16


@dataclass(frozen=True)
class Columns:
    """Decoded messages: ``table`` has a row for each good one; ``good`` is (n,) over all."""

    table: pd.DataFrame
    good: NDArray[np.bool_]
    left_out: tuple[str, ...] = ()


def decode_cdr(
    data: Bytes,
    start: Integers,
    end: Integers,
    definitions: Definitions,
    name: str,
    lengths: Mapping[str, int],
) -> Columns:
    """Decode messages of one type.

    Parameters
    ----------
    data : (n,) uint8
        Bytes that hold the messages ``data[start:end]``.
    definitions, name : mapping, str
        Every type that is needed, and the message's.
    lengths : mapping of str to int
        Longest occurrence of each array, as ``array_lengths`` gives it.
    """
    program = build(definitions, name, lengths)
    floats, integers, begins, ends, longest = _slots(program, len(start))
    good = _walk(data, start, end, program.table, floats, integers, begins, ends, longest, SIZES)
    left_out = tuple(
        p for p in program.loops if lengths.get(p, 0) and not any(c.startswith(p) for c in _all(program))
    )
    return Columns(_table(data, program, floats, integers, begins, ends, good), good, left_out)


def array_lengths(
    data: Bytes, start: Integers, end: Integers, definitions: Definitions, name: str
) -> dict[str, int]:
    """Longest occurrence of each array whose length is in the message."""
    program = build(definitions, name)
    if not program.loops:
        return {}
    floats, integers, begins, ends, longest = _slots(program, len(start))
    _walk(data, start, end, program.table, floats, integers, begins, ends, longest, SIZES)
    return {path: int(count) for path, count in zip(program.loops, longest, strict=False)}


def _slots(program: Program, n: int) -> tuple[NDArray[np.float64], Integers, Integers, Integers, Integers]:
    """Room for n messages, each column in one piece of memory, and for the lengths of the arrays."""
    floats = np.full((len(program.floats), n), np.nan).T
    integers = np.zeros((len(program.integers), n), np.int64).T
    begins, ends = (np.zeros((len(program.texts), n), np.int64).T for _ in range(2))
    return floats, integers, begins, ends, np.zeros(max(1, len(program.loops)), np.int64)


def _all(program: Program) -> list[str]:
    return [*program.floats, *program.texts]


def _table(
    data: Bytes,
    program: Program,
    floats: NDArray[np.float64],
    integers: Integers,
    begins: Integers,
    ends: Integers,
    good: NDArray[np.bool_],
) -> pd.DataFrame:
    keep = slice(None) if good.all() else good
    columns: dict[str, object] = {c: floats[keep, i] for i, c in enumerate(program.floats)}
    for i, name in enumerate(program.integers):
        values = integers[keep, i]
        columns[name] = values.astype(bool) if name in program.booleans else values
    for i, name in enumerate(program.texts):
        columns[name] = texts(data, begins[keep, i], ends[keep, i])
    return pd.DataFrame(with_stamps(columns), copy=False)


def with_stamps(columns: dict[str, object]) -> dict[str, object]:
    """Return the stamp of the header as one number of nanoseconds, ``stamp_ns``."""
    for prefix in ("header.stamp", "stamp", "timestamp"):
        for fraction in ("nanosec", "nanosecond", "nsec"):
            second, part = columns.get(f"{prefix}.sec"), columns.get(f"{prefix}.{fraction}")
            if second is not None and part is not None:
                ns = np.asarray(second, np.int64) * 1_000_000_000 + np.asarray(part, np.int64)
                rest = {
                    k: v for k, v in columns.items() if k not in {f"{prefix}.sec", f"{prefix}.{fraction}"}
                }
                return {"stamp_ns": ns, **rest}
    return columns


@compiled
def _walk(
    data: Bytes,
    start: Integers,
    end: Integers,
    steps: Integers,
    floats: NDArray[np.float64],
    integers: Integers,
    begins: Integers,
    ends: Integers,
    longest: Integers,
    sizes: Integers,
) -> NDArray[np.bool_]:
    """Walk over every message; false where one ends before its definition does."""
    good = np.zeros(len(start), np.bool_)
    scratch = np.zeros(8, np.uint8)
    views = (
        scratch.view(np.float64), scratch.view(np.float32), scratch.view(np.int64), scratch.view(np.int32),
        scratch.view(np.uint32), scratch.view(np.int16), scratch.view(np.uint16), scratch.view(np.int8),
    )  # fmt: skip
    index, count = np.zeros(DEPTH, np.int64), np.zeros(DEPTH, np.int64)
    for i in range(len(start)):
        good[i] = _walk_one(
            data,
            start[i],
            end[i],
            steps,
            i,
            floats,
            integers,
            begins,
            ends,
            longest,
            sizes,
            scratch,
            views,
            index,
            count,
        )
        if not good[i]:
            floats[i] = np.nan
    return good


@compiled
def _walk_one(
    data: Bytes,
    start: int,
    end: int,
    steps: Integers,
    row: int,
    floats: NDArray[np.float64],
    integers: Integers,
    begins: Integers,
    ends: Integers,
    longest: Integers,
    sizes: Integers,
    scratch: Bytes,
    views: Views,
    index: Integers,
    count: Integers,
) -> bool:
    if end - start < 4 or data[start] != 0 or data[start + 1] not in (0, 1, 6, 7):
        return False
    little = data[start + 1] & 1 == 1
    most = 8 if data[start + 1] < 6 else 4
    origin, p = start + 4, start + 4
    depth, pc = -1, 0
    while pc < len(steps):
        step, a, slot, stride, last = steps[pc, 0], steps[pc, 1], steps[pc, 2], steps[pc, 3], steps[pc, 4]
        if step == SCALAR:
            size = int(sizes[a])
            p = _aligned(p, origin, min(size, most))
            if p + size > end:
                return False
            if slot >= 0:
                target = slot + (index[depth] * stride if stride else 0)
                _copy(data, p, size, little, scratch)
                if last:
                    integers[row, target] = _integer(scratch, views, a)
                else:
                    floats[row, target] = _real(scratch, views, a)
            p += size
        elif step == LOOP:
            often = a
            if often < 0:
                p = _aligned(p, origin, 4)
                if p + 4 > end:
                    return False
                _copy(data, p, 4, little, scratch)
                often = int(views[4][0])
                p += 4
                if often > end - p:
                    return False
                longest[slot] = max(longest[slot], often)
            if often == 0:
                pc = stride
            elif last > 0:
                p = _aligned(p, origin, min(last, most)) + often * last
                if p > end:
                    return False
                pc = stride
            else:
                depth += 1
                if depth >= DEPTH:
                    return False
                index[depth], count[depth] = 0, often
        elif step == END:
            index[depth] += 1
            if index[depth] < count[depth]:
                pc = stride
            else:
                depth -= 1
        else:
            p = _aligned(p, origin, 4)
            if p + 4 > end:
                return False
            _copy(data, p, 4, little, scratch)
            size = int(views[4][0]) * (1 if step == TEXT else 2)
            p += 4
            if p + size > end:
                return False
            if slot >= 0:
                target = slot + (index[depth] * stride if stride else 0)
                zero = size > 0 and data[p + size - 1] == 0
                begins[row, target], ends[row, target] = p, p + size - (1 if zero else 0)
            p += size
        pc += 1
    return True


@compiled
def _aligned(p: int, origin: int, size: int) -> int:
    over = (p - origin) % size
    return p + (size - over if over else 0)


@compiled
def _copy(data: Bytes, p: int, size: int, little: bool, scratch: Bytes) -> None:
    for k in range(size):
        scratch[k] = data[p + k] if little else data[p + size - 1 - k]


@compiled
def _integer(scratch: Bytes, views: Views, code: int) -> int:
    if code == I4:
        return int(views[3][0])
    if code == U4:
        return int(views[4][0])
    if code == U1:
        return int(scratch[0])
    if code == I1:
        return int(views[7][0])
    if code == I2:
        return int(views[5][0])
    if code == U2:
        return int(views[6][0])
    return int(views[2][0])


@compiled
def _real(scratch: Bytes, views: Views, code: int) -> float:
    if code == F8:
        return float(views[0][0])
    if code == F4:
        return float(views[1][0])
    return float(_integer(scratch, views, code))
