"""From records of one type to a table: the part that MAVLink, DataFlash and ULog share."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray


def text_column(raw: NDArray[np.bytes_], decode: Callable[[bytes], str]) -> NDArray[np.object_]:
    """Decode fixed-size strings, without the zeros at their end: each distinct one once."""
    distinct, which = np.unique(raw, return_inverse=True)
    texts = np.empty(len(distinct), dtype=object)
    texts[:] = [decode(bytes(t)) for t in distinct]
    return texts[which.ravel()]


def ascii_text(raw: bytes) -> str:
    """Decode what comes before the first zero as ASCII, as pymavlink does; what is none is replaced."""
    return raw.split(b"\0")[0].decode("ascii", errors="replace")


def decoded(raw: bytes) -> str:
    """UTF-8, or else Latin-1."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def terminated(raw: bytes) -> str:
    """Give what comes before the first zero: UTF-8, or else Latin-1 (as DFReader shows DataFlash strings)."""
    return decoded(raw.split(b"\0")[0])


def spread(records: NDArray[np.void], fields: Iterable[str]) -> dict[str, NDArray[np.generic]]:
    """One column per field; an array field gives ``name[0]``, ``name[1]``, …; strings are decoded."""
    out: dict[str, NDArray[np.generic]] = {}
    for name in fields:
        values = records[name]
        if values.ndim == 2:
            out.update({f"{name}[{k}]": values[:, k] for k in range(values.shape[1])})
        else:
            out[name] = text_column(values, ascii_text) if values.dtype.kind == "S" else values
    return out


def spread_names(name: str, dtype: np.dtype[np.void]) -> list[str]:
    """Names of the columns that a field becomes."""
    shape = dtype[name].shape
    return [f"{name}[{k}]" for k in range(shape[0])] if shape else [name]


def grouped(codes: NDArray[np.integer[Any]]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Each code (small, from −1 on) with the rows that have it, in order."""
    order = np.argsort(codes, kind="stable")
    counts = np.bincount(codes.astype(np.int64, copy=False) + 1)
    ends = np.cumsum(counts)
    for k in np.flatnonzero(counts):
        yield int(k) - 1, order[ends[k] - counts[k] : ends[k]]


def without(values: NDArray[np.generic], code: int) -> NDArray[np.generic]:
    """Replace a "not available" code by NaN; where it does not occur, the integers stay untouched."""
    missing = values == code
    return np.where(missing, np.nan, values.astype(float)) if missing.any() else values


def table(t_ns: NDArray[np.int64], columns: Mapping[str, NDArray[np.generic]]) -> pd.DataFrame:
    """Make the table of a topic; strided columns are copied once."""
    return pd.DataFrame(dict(columns), index=pd.Index(t_ns, name="t_ns"))
