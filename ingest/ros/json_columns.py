"""JSON messages to columns: all messages of a batch in one go, and column by column, not message by message."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.ros.cdr import with_stamps
from ingest.ros.program import DEEPEST, MOST_ELEMENTS

#: Stands between two messages, so that what a broken one takes from its neighbour shows.
BETWEEN = "\u2063seatrial\u2063"


def columns_of(
    data: NDArray[np.uint8], start: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[pd.DataFrame, NDArray[np.bool_]]:
    """Decode messages ``data[start:end]``; a column per scalar, nested ones dotted, elements of lists ``name[i]``.

    Returns
    -------
    table : DataFrame
        A row per good message: numbers, truth values, texts as categories. Lists of more than ``MOST_ELEMENTS``
        elements are left out.
    good : (n,) bool
        Messages that are JSON.
    """
    view = np.ascontiguousarray(data).data
    raw = [view[a:b] for a, b in zip(start.tolist(), end.tolist(), strict=True)]
    objects = together(raw)
    if objects is None:
        objects = [alone(r) for r in raw]
    good = np.array([o is not None for o in objects], np.bool_)
    columns = dict(flat([o if type(o) is dict else {"data": o} for o in objects if o is not None], "", 0))
    return pd.DataFrame(with_stamps(columns)), good


def together(raw: Sequence[memoryview]) -> list[Any] | None:
    """The values of all messages, parsed at once; None where one of them is broken."""
    mark = b',"' + BETWEEN.encode() + b'",'
    try:
        values = json.loads(b"[" + mark.join(raw) + b"]")
    except (ValueError, RecursionError):
        return None
    whole = len(values) == 2 * len(raw) - 1 and all(v == BETWEEN for v in values[1::2])
    return values[::2] if whole else None


def alone(raw: memoryview) -> Any:
    """The value of one message; None where it is none."""
    try:
        return json.loads(bytes(raw))
    except (ValueError, RecursionError):
        return None


def flat(values: Sequence[Any], path: str, depth: int) -> Iterator[tuple[str, object]]:
    """Name and column of every scalar in values of one place of the messages; None is absent."""
    kinds = set(map(type, values))
    if depth > DEEPEST:
        return
    if dict in kinds:
        members = values if kinds <= {dict} else [v if type(v) is dict else {} for v in values]
        for key in dict.fromkeys(chain.from_iterable(filter(None, members))):
            inner = [m.get(key) if m else None for m in members]
            yield from flat(inner, f"{path}.{key}" if path else str(key), depth + 1)
    if kinds == {list} and (matrix := rectangle(values)) is not None:
        yield from ((f"{path}[{i}]", matrix[:, i]) for i in range(matrix.shape[1]))
    elif list in kinds:
        lists = [v if type(v) is list else () for v in values]
        longest = max(map(len, lists))
        for i in range(longest if longest <= MOST_ELEMENTS else 0):
            yield from flat([v[i] if len(v) > i else None for v in lists], f"{path}[{i}]", depth + 1)
    scalars = kinds - {dict, list, type(None)}
    if scalars:
        plain = (
            values if not kinds & {dict, list} else [None if type(v) in (dict, list) else v for v in values]
        )
        yield path, column_of(plain, scalars, type(None) in kinds or bool(kinds & {dict, list}))


def rectangle(lists: Sequence[list[Any]]) -> NDArray[Any] | None:
    """Lists of numbers that are all as long as each other, not too long, as a matrix; None for others."""
    if not 0 < len(lists[0]) <= MOST_ELEMENTS or not set(map(type, lists[0])) <= {int, float}:
        return None
    try:
        matrix = np.array(lists)
    except (ValueError, OverflowError):
        return None
    return matrix if matrix.ndim == 2 and matrix.dtype.kind in "if" else None


def column_of(values: Sequence[Any], kinds: set[type], gaps: bool) -> object:
    """Scalars as an array: whole numbers and truth values only where none is missing; else floats, else texts."""
    if str not in kinds:
        try:
            if not gaps and len(kinds) == 1 and float not in kinds:
                return np.array(values, np.bool_ if bool in kinds else np.int64)
            return np.array(values, np.float64)
        except OverflowError:
            pass
    return pd.Categorical([v if v is None or type(v) is str else str(v) for v in values])
