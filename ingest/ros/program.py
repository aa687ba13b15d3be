"""A message definition as a flat list of steps, so that compiled code can walk any message."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Steps. SCALAR: type, slot, stride. TEXT: -, slot, stride. LOOP: fixed count (−1: it is in the message),
#: number of
#: the loop, index of its END, size of its only scalar (0: more than one). END: -, -, index of its LOOP.
SCALAR, TEXT, WIDE_TEXT, LOOP, END = 0, 1, 2, 3, 4

#: Types of scalars: code, size and whether they go to the integers.
F4, F8, I1, U1, I2, U2, I4, U4, I8, U8 = range(10)
TYPES: Mapping[str, tuple[int, int]] = {
    "float32": (F4, 4), "float64": (F8, 8), "int8": (I1, 1), "uint8": (U1, 1), "bool": (U1, 1), "byte": (U1,
        1),
    "octet": (U1, 1), "char": (U1, 1), "int16": (I2, 2), "uint16": (U2, 2), "int32": (I4, 4), "uint32": (U4,
        4),
    "int64": (I8, 8), "uint64": (U8, 8),
}  # fmt: skip
SIZES = np.array([4, 8, 1, 1, 2, 2, 4, 4, 8, 8], np.int64)

#: Arrays with at most so many elements become columns; longer ones (images, point clouds) are left out.
MOST_ELEMENTS = 128

#: A definition that goes deeper, or has more scalars, is garbled.
DEEPEST, MOST_STEPS = 32, 20_000

#: Definitions as rosbags parses them: type name to (constants, fields).
Definitions = Mapping[str, tuple[Any, Any]]


class BadDefinition(ValueError):
    """A message definition that cannot be used."""


class UnknownType(BadDefinition):
    """A message type whose definition is not in the file."""

    def __init__(self, name: str) -> None:
        self.name = name
        super().__init__(f"the definition of '{name}' is not in the file")


@dataclass
class Program:
    """Steps and slots of a message type, as they are collected.

    Attributes
    ----------
    steps : list of tuple
        Rows of the table that compiled code walks.
    floats, integers, texts : list of str
        Name of the column in each slot.
    booleans : set of str
        Integer columns that are true or false.
    loops : list of str
        Name of the array that each loop goes through.
    """

    steps: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    floats: list[str] = field(default_factory=list)
    integers: list[str] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)
    booleans: set[str] = field(default_factory=set)
    loops: list[str] = field(default_factory=list)

    @property
    def table(self) -> NDArray[np.int64]:
        """The steps as an array, (n, 5)."""
        return np.array(self.steps or [(END, 0, 0, -1, 0)], np.int64).reshape(-1, 5)


def build(definitions: Definitions, name: str, lengths: Mapping[str, int] | None = None) -> Program:
    """Make the program of a message type.

    Parameters
    ----------
    definitions : mapping
        Every type that the message needs.
    name : str
        ``package/msg/Type``.
    lengths : mapping of str to int, optional
        Longest occurrence of each array whose length is in the message; without it, none becomes columns.

    Raises
    ------
    UnknownType
        Where a definition is missing.
    """
    program = Program()
    _message(program, definitions, name, "", lengths or {}, None)
    return program


@dataclass
class _Repeated:
    """An array whose elements become columns: how often, and how many slots of each kind one element has."""

    often: int
    floats: int = 0
    texts: int = 0


def _message(
    program: Program,
    definitions: Definitions,
    name: str,
    prefix: str,
    lengths: Mapping[str, int],
    inside: object,
) -> None:
    if name not in definitions:
        raise UnknownType(name)
    if prefix.count(".") > DEEPEST or len(program.steps) > MOST_STEPS:
        raise BadDefinition(f"the definition of '{name}' is endless")
    members = definitions[name][1]
    if not members:
        program.steps.append((SCALAR, U1, -1, 0, 0))
    for member, what in members:
        _member(program, definitions, what, prefix + member, lengths, inside)


def _member(
    program: Program,
    definitions: Definitions,
    what: Any,
    path: str,
    lengths: Mapping[str, int],
    inside: object,
) -> None:
    kind, detail = int(what[0]), what[1]
    if kind == 1:
        _base(program, detail[0], path, inside)
    elif kind == 2 and detail.endswith("/wstring"):
        program.steps.append((WIDE_TEXT, 0, -1, 0, 0))
    elif kind == 2:
        _message(program, definitions, detail, path + ".", lengths, inside)
    elif kind == 3 and detail[1] <= MOST_ELEMENTS:
        for i in range(detail[1]):
            _member(program, definitions, detail[0], f"{path}[{i}]", lengths, inside)
    else:
        fixed = detail[1] if kind == 3 else -1
        _array(program, definitions, detail[0], path, fixed, lengths, inside)


def _base(program: Program, name: str, path: str, inside: object) -> None:
    if name in {"string", "wstring"}:
        step = TEXT if name == "string" else WIDE_TEXT
        slot = _slot(program.texts, path, inside) if name == "string" else -1
        program.steps.append((step, 0, slot, 0, 0))
        return
    if name not in TYPES:
        raise UnknownType(name)
    code, _ = TYPES[name]
    real = code in (F4, F8) or inside is not None
    slot = _slot(program.floats if real else program.integers, path, inside)
    if name == "bool" and not real:
        program.booleans.add(path)
    program.steps.append((SCALAR, code, slot, 0, 0 if real else 1))


def _slot(columns: list[str], path: str, inside: object) -> int:
    """Return a new slot for a column; −1 where an array is too long or too deep to become columns."""
    if isinstance(inside, _Repeated) and inside.often == 0:
        return -1
    columns.append(path)
    return len(columns) - 1


def _array(
    program: Program,
    definitions: Definitions,
    element: Any,
    path: str,
    fixed: int,
    lengths: Mapping[str, int],
    inside: object,
) -> None:
    number = len(program.loops)
    program.loops.append(path)
    often = lengths.get(path, 0) if fixed < 0 and inside is None else 0
    often = often if often <= MOST_ELEMENTS else 0
    start = len(program.steps)
    program.steps.append((LOOP, fixed, number, 0, 0))
    floats, texts = len(program.floats), len(program.texts)
    _member(program, definitions, element, f"{path}[0]", lengths, _Repeated(often))
    body = program.steps[start + 1 :]
    strides = len(program.floats) - floats, len(program.texts) - texts
    if often:
        _strided(program, start, strides)
        _repeat(program.floats, floats, strides[0], path, often)
        _repeat(program.texts, texts, strides[1], path, often)
    single = len(body) == 1 and body[0][0] == SCALAR
    size = int(SIZES[body[0][1]]) if single else 0
    program.steps[start] = (LOOP, fixed, number, len(program.steps), size if not often else -size)
    program.steps.append((END, 0, 0, start, 0))


def _strided(program: Program, start: int, strides: tuple[int, int]) -> None:
    """Write into the steps of an array's element how far apart the slots of its elements are."""
    for i in range(start + 1, len(program.steps)):
        step, a, slot, stride, last = program.steps[i]
        if step in (SCALAR, TEXT) and slot >= 0 and stride == 0:
            program.steps[i] = (step, a, slot, strides[0 if step == SCALAR else 1], last)


def _repeat(columns: list[str], first: int, count: int, path: str, often: int) -> None:
    head = f"{path}[0]"
    once = columns[first : first + count]
    for i in range(1, often):
        columns.extend(f"{path}[{i}]{name[len(head) :]}" for name in once)
