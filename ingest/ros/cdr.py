"""CDR, the wire format of ROS 2: all messages of a type at once, by a compiled walk over its definition."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

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
    Definitions,
    Program,
    build,
)

Integers = NDArray[np.int64]
Bytes = NDArray[np.uint8]
#: Numbers, whole numbers, begins and ends of texts, (n, slots) each, and the lengths of the arrays.
Slots = tuple[NDArray[np.float64], Integers, Integers, Integers, Integers]
DEPTH = 16
#: What ROS 2, Foxglove's JSON and protobuf call the two parts of a time.
STAMPS = (("sec", "nanosec"), ("sec", "nanosecond"), ("sec", "nsec"), ("seconds", "nanos"))


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
    slots = _slots(program, len(start))
    good = _walked(data, start, end, program, slots)
    left_out = tuple(
        p for p in program.loops if lengths.get(p, 0) and not any(c.startswith(p) for c in _all(program))
    )
    return Columns(_table(data, program, slots, good), good, left_out)


def array_lengths(
    data: Bytes, start: Integers, end: Integers, definitions: Definitions, name: str
) -> dict[str, int]:
    """Longest occurrence of each array whose length is in the message."""
    program = build(definitions, name)
    if not program.loops:
        return {}
    slots = _slots(program, len(start))
    _walked(data, start, end, program, slots)
    return {path: int(count) for path, count in zip(program.loops, slots[-1], strict=False)}


def _slots(program: Program, n: int) -> Slots:
    """Room for n messages, each column in one piece of memory, and for the lengths of the arrays."""
    floats = np.full((len(program.floats), n), np.nan).T
    integers = np.zeros((len(program.integers), n), np.int64).T
    begins, ends = (np.zeros((len(program.texts), n), np.int64).T for _ in range(2))
    return floats, integers, begins, ends, np.zeros(max(1, len(program.loops)), np.int64)


def _all(program: Program) -> list[str]:
    return [*program.floats, *program.texts]


def _table(data: Bytes, program: Program, slots: Slots, good: NDArray[np.bool_]) -> pd.DataFrame:
    floats, integers, begins, ends, _ = slots
    data = read_only(data)
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
        for seconds, fraction in STAMPS:
            second, part = columns.get(f"{prefix}.{seconds}"), columns.get(f"{prefix}.{fraction}")
            if is_number(second) and is_number(part):
                ns = whole(second) * 1_000_000_000 + whole(part)
                rest = {
                    k: v
                    for k, v in columns.items()
                    if k not in {f"{prefix}.{seconds}", f"{prefix}.{fraction}"}
                }
                return {"stamp_ns": ns, **rest}
    return columns


def is_number(column: object) -> bool:
    """Whether a column is there and holds numbers."""
    return isinstance(column, np.ndarray) and column.dtype.kind in "iuf"


def whole(column: object) -> Integers:
    """Whole numbers of a column; 0 where it has none."""
    values = np.asarray(column)
    if values.dtype.kind == "f":
        values = np.where(np.abs(values) < float(1 << 62), values, 0.0)
    return values.astype(np.int64)


def _walked(data: Bytes, start: Integers, end: Integers, program: Program, slots: Slots) -> NDArray[np.bool_]:
    """Fill the slots from every message; false where one ends before its definition does; (n,)."""
    good = np.zeros(len(start), np.bool_)
    word = np.zeros(1, np.uint64)
    loops = np.zeros((2, DEPTH), np.int64)
    reals = word.view(np.float64), word.view(np.float32)
    _walk(read_only(data), start, end, program.table, *slots, SIZES, word, *reals, loops, good)
    return good


def read_only(data: Bytes) -> Bytes:
    """The same bytes, not to be written to: arrays of one kind need one compilation."""
    view = data.view()
    view.flags.writeable = False
    return view


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
    word: NDArray[np.uint64],
    doubles: NDArray[np.float64],
    singles: NDArray[np.float32],
    loops: Integers,
    good: NDArray[np.bool_],
) -> None:
    """Walk over every message; ``loops`` holds index and count of each loop that is open."""
    for row in range(len(start)):
        p, stop = start[row], end[row]
        if stop - p < 4 or data[p] != 0 or data[p + 1] not in (0, 1, 6, 7):
            continue
        little, most = data[p + 1] & 1 == 1, 8 if data[p + 1] < 6 else 4
        p += 4
        origin, depth, pc = p, -1, 0
        while pc < len(steps):
            step, a, slot, stride, last = steps[pc, 0], steps[pc, 1], steps[pc, 2], steps[pc, 3], steps[pc, 4]
            pc += 1
            if step == END:
                loops[0, depth] += 1
                if loops[0, depth] < loops[1, depth]:
                    pc = stride + 1
                else:
                    depth -= 1
                continue
            target = slot + loops[0, depth] * stride if stride and step != LOOP else slot
            size = sizes[a] if step == SCALAR else 4
            value = np.uint64(0)
            if step != LOOP or a < 0:
                p = _aligned(p, origin, min(size, most))
                if p + size > stop:
                    break
                value = _bits(data, p, size, little)
                p += size
            if step == SCALAR:
                if slot >= 0 and last:
                    integers[row, target] = _signed(value, a, size)
                elif slot >= 0:
                    word[0] = value
                    if a == F8:
                        floats[row, target] = doubles[0]
                    elif a == F4:
                        floats[row, target] = singles[0]
                    else:
                        floats[row, target] = _signed(value, a, size)
            elif step == LOOP:
                often = np.int64(value) if a < 0 else a
                if a < 0:
                    if often > stop - p:
                        break
                    longest[slot] = max(longest[slot], often)
                if often == 0:
                    pc = stride + 1
                elif last > 0:
                    p = _aligned(p, origin, min(last, most)) + often * last
                    if p > stop:
                        break
                    pc = stride + 1
                else:
                    depth += 1
                    if depth >= DEPTH:
                        break
                    loops[0, depth], loops[1, depth] = 0, often
            else:
                room = np.int64(value) * (1 if step == TEXT else 2)
                if p + room > stop:
                    break
                if slot >= 0:
                    zero = room > 0 and data[p + room - 1] == 0
                    begins[row, target], ends[row, target] = p, p + room - (1 if zero else 0)
                p += room
        else:
            good[row] = True


@compiled
def _aligned(p: int, origin: int, size: int) -> int:
    over = (p - origin) % size
    return p + (size - over if over else 0)


@compiled
def _bits(data: Bytes, p: int, size: int, little: bool) -> np.uint64:
    """The bytes at ``p`` as one unsigned number."""
    value = np.uint64(0)
    for k in range(size):
        value = (value << np.uint64(8)) | np.uint64(data[p + size - 1 - k] if little else data[p + k])
    return value


@compiled
def _signed(value: np.uint64, code: int, size: int) -> int:
    """An unsigned number of ``size`` bytes as what its type stands for."""
    whole = np.int64(value)
    if code in (I1, I2, I4):
        shift = 64 - 8 * size
        whole = (whole << shift) >> shift
    return int(whole)
