"""Protobuf messages to columns, by the descriptor that the file carries."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from itertools import chain
from operator import attrgetter
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.ros.cdr import with_stamps
from ingest.ros.program import MOST_ELEMENTS, UnknownType

#: Types of fields that hold floating-point numbers.
REALS = (1, 2)


@functools.lru_cache(maxsize=32)
def message_class(name: str, descriptors: bytes) -> Any:
    """Return the class of a message type, from a serialised ``FileDescriptorSet``."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message, message_factory

    try:
        files = descriptor_pb2.FileDescriptorSet.FromString(descriptors)
        pool = descriptor_pool.DescriptorPool()
        for file in _in_order(files.file):
            pool.Add(file)
        return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))
    except (message.DecodeError, KeyError, TypeError) as error:
        raise UnknownType(name) from error


def _in_order(files: Any) -> Iterator[Any]:
    """Files, those that others import first."""
    left = {f.name: f for f in files}
    while left:
        ready = [n for n, f in left.items() if not any(d in left for d in f.dependency)] or list(left)[:1]
        for name in ready:
            yield left.pop(name)


def columns_of(
    name: str, descriptors: bytes, data: NDArray[np.uint8], start: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[pd.DataFrame, NDArray[np.bool_]]:
    """Decode messages; a column per scalar field, nested ones dotted, repeated ones ``field[i]``.

    Returns
    -------
    table : DataFrame
        A row per good message.
    good : (n,) bool
        Messages that could be parsed.
    """
    kind = message_class(name, descriptors)
    blob = data.tobytes()
    raw = [blob[a:b] for a, b in zip(start.tolist(), end.tolist(), strict=True)]
    parsed = _parsed(kind, raw)
    good = np.array([m is not None for m in parsed], bool)
    messages = [m for m in parsed if m is not None]
    columns: dict[str, object] = {}
    _collect(kind.DESCRIPTOR, messages, "", columns, 0)
    return pd.DataFrame(with_stamps(columns)), good


def _parsed(kind: Any, raw: list[bytes]) -> list[Any]:
    """All messages in one go; one by one, with None for what is none, where one of them is broken."""
    from google.protobuf.message import DecodeError

    try:
        return list(map(kind.FromString, raw))
    except DecodeError:
        return [_parse(kind, r) for r in raw]


def _parse(kind: Any, raw: bytes) -> Any:
    from google.protobuf.message import DecodeError

    try:
        return kind.FromString(raw)
    except DecodeError:
        return None


def _collect(descriptor: Any, messages: list[Any], path: str, columns: dict[str, object], depth: int) -> None:
    """Columns of all fields of a list of messages (None: absent)."""
    whole = None not in messages
    for field in descriptor.fields:
        name, nested, take = f"{path}{field.name}", field.message_type, attrgetter(field.name)
        values: list[Any] = (
            list(map(take, messages)) if whole else [None if m is None else take(m) for m in messages]
        )
        if field.is_repeated:
            longest = max((len(v) for v in values if v is not None), default=0)
            if longest > MOST_ELEMENTS or (nested is not None and nested.GetOptions().map_entry):
                continue
            flat = whole and nested is None and field.type in REALS
            if flat and 0 < longest == min(map(len, values)):
                numbers = np.fromiter(chain.from_iterable(values), np.float64, len(values) * longest)
                columns.update({f"{name}[{i}]": numbers[i::longest] for i in range(longest)})
                continue
            for i in range(longest):
                _put(f"{name}[{i}]", nested, [v[i] if v is not None and len(v) > i else None for v in values],
                     columns, depth)  # fmt: skip
        elif nested is None:
            _put(name, nested, values, columns, depth)
        elif any(m is not None and m.HasField(field.name) for m in messages):
            present = [v if m is not None and m.HasField(field.name) else None
                       for m, v in zip(messages, values, strict=True)]  # fmt: skip
            _put(name, nested, present, columns, depth)


def _put(name: str, nested: Any, values: list[Any], columns: dict[str, object], depth: int) -> None:
    if nested is not None:
        if depth < 16:
            _collect(nested, values, name + ".", columns, depth + 1)
        return
    first = next((v for v in values if v is not None), None)
    if isinstance(first, str):
        columns[name] = pd.Categorical(values)
    elif isinstance(first, (bool, int, float)):
        whole = isinstance(first, int) and None not in values
        columns[name] = np.array(values) if whole else np.array(values, float)
