"""The reader of MATLAB files: named vectors, in version 5 (and 4) and in version 7.3, which is HDF5."""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import Finding
from ingest.reader import Decoded, Reader, ReadOptions
from ingest.tabular.delimited import timed
from ingest.tabular.matlab_tags import sound
from ingest.tabular.timeline import clock_of

Arrays = dict[str, NDArray[Any]]

HDF5 = b"\x89HDF\r\n\x1a\n"
HEADER, TAG = 128, 8
#: Matrices with at most so many columns become columns of their own.
MOST_COLUMNS = 64
#: MATLAB's day number of 1970-01-01, and the day numbers that are taken for dates (1916 to 2190).
DAY_OF_1970, FIRST_DAY, LAST_DAY = 719_529.0, 7.0e5, 8.0e5


def sniff(head: bytes) -> float:
    """How sure the bytes are a MATLAB file."""
    if head.startswith(b"MATLAB 5.0 MAT-file"):
        return 1.0
    if head.startswith(b"MATLAB 7.3 MAT-file") or head[512:520] == HDF5:
        return 0.95
    return 0.3 if head.startswith(HDF5) else 0.0


def read(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
    """Read the vectors of a MATLAB file; those of a struct with a time vector of its own are a topic.

    Raises
    ------
    ValueError
        Where there is no time vector, or no vector as long as it.
    """
    findings: list[Finding] = []
    hdf = bytes(data[512:520]) == HDF5 or bytes(data[:8]) == HDF5
    arrays = hdf_arrays(data, findings) if hdf else matlab5_arrays(data, findings)
    tables = {topic: table for topic, table in grouped(arrays, findings).items() if wanted(topic, options)}
    if not tables:
        raise ValueError(
            f"no time vector with vectors of its length; found {', '.join(sorted(arrays)[:12]) or 'none'}"
        )
    parts = [timed(table, {}, topic) for topic, table in tables.items()]
    zero = {p.utc_of_index_zero_ns for p in parts}
    return Decoded(
        tables={t: table for p in parts for t, table in p.tables.items()},
        units={k: u for p in parts for k, u in p.units.items()},
        utc_of_index_zero_ns=zero.pop() if len(zero) == 1 else None,
        findings=(*findings, *(f for p in parts for f in p.findings)),
        messages=sum(p.messages for p in parts),
        bytes_damaged=sum(f.length or 0 for f in findings),
        sources=tuple(sorted((s for p in parts for s in p.sources), key=lambda s: -s.rank)),
    )


def wanted(topic: str, options: ReadOptions) -> bool:
    """Whether a topic was asked for."""
    return options.topics is None or topic in options.topics


def matlab5_arrays(data: memoryview, findings: list[Finding]) -> Arrays:
    """Numeric arrays of a version 5 file, element by element, so that a broken one costs only itself."""
    header = bytes(data[:HEADER])
    if not header.startswith(b"MATLAB 5.0"):
        return _load(bytes(data), findings, 0)
    arrays: Arrays = {}
    order = "<" if header[126:128] == b"IM" else ">"
    p = HEADER
    while p < len(data):
        size = struct.unpack_from(f"{order}I", data, p + 4)[0] if p + TAG <= len(data) else len(data)
        end = p + TAG + size
        if end > len(data):
            findings.append(
                Finding("truncated", "the last variable is cut off", offset=p, length=len(data) - p)
            )
            break
        arrays |= _load(header + bytes(data[p:end]), findings, p)
        p = end
    return arrays


def _load(raw: bytes, findings: list[Finding], offset: int) -> Arrays:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    errors = (ValueError, TypeError, IndexError, KeyError, OSError, NotImplementedError, AttributeError,
        MemoryError,
              ArithmeticError, NameError, zlib.error, struct.error, MatReadError, SystemError)  # fmt: skip
    try:
        if not sound(raw, "<" if raw[126:128] == b"IM" else ">", HEADER):
            raise TypeError("an element of it has no known type, or is longer than the file")
        with warnings.catch_warnings(action="ignore"):
            content = loadmat(cast(Any, io.BytesIO(raw)), struct_as_record=True, squeeze_me=True)
    except errors as error:
        text = f"a variable cannot be read ({type(error).__name__}: {error})"
        findings.append(Finding("damaged", text, offset=offset, length=max(0, len(raw) - HEADER)))
        return {}
    return {
        n: a for key, value in content.items() if not key.startswith("__") for n, a in _numeric(key, value)
    }


def _numeric(name: str, value: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Numeric vectors and matrices in a variable; members of structs are joined with dots."""
    array = np.asarray(value)
    if array.dtype.names and array.size == 1:
        record = array.ravel()[0]
        for member in array.dtype.names:
            yield from _numeric(f"{name}.{member}", record[member])
    elif array.dtype.kind in "biuf" and array.ndim in (1, 2) and array.size > 1:
        yield name, array


def hdf_arrays(data: memoryview, findings: list[Finding]) -> Arrays:
    """Numeric arrays of a version 7.3 file; MATLAB stores them transposed."""
    import h5py

    arrays: Arrays = {}

    def visit(name: str, item: object) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#"):
            return
        kind = item.attrs.get("MATLAB_class", b"double")
        if kind in (b"char", b"cell") or item.dtype.kind not in "biuf" or item.size < 2 or item.ndim > 2:
            return
        arrays[name.replace("/", ".")] = np.squeeze(np.asarray(item[()])).T

    try:
        with h5py.File(io.BytesIO(data), "r") as file:
            file.visititems(visit)
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        findings.append(Finding("damaged", f"the HDF5 structure is broken ({error}); read up to there"))
    return arrays


def grouped(arrays: Mapping[str, NDArray[Any]], findings: list[Finding]) -> dict[str, pd.DataFrame]:
    """Tables of the vectors that share a time vector: one of each struct that has one, one of the rest."""
    groups: dict[str, Arrays] = {}
    for name, array in arrays.items():
        groups.setdefault(name.rpartition(".")[0], {})[name.rpartition(".")[2]] = array
    tables = {group: table for group, vectors in groups.items() if (table := _table(vectors)) is not None}
    used = {f"{g}.{c}".lstrip(".") for g, t in tables.items() for c in t.columns}
    left = [n for n in arrays if n not in used and f"{n}[0]" not in used]
    if left and tables:
        text = f"{len(left)} arrays have no time vector of their length: {', '.join(left[:6])}"
        findings.append(Finding("note", text, count=len(left)))
    return tables


def _table(vectors: Arrays) -> pd.DataFrame | None:
    """Return the vectors as long as the one that looks like time; None where none does."""
    lengths = sorted(
        {a.shape[0] for a in vectors.values()} | {a.shape[-1] for a in vectors.values()}, reverse=True
    )
    for length in lengths:
        columns = dict(c for name, a in vectors.items() for c in _columns(name, a, length))
        table = pd.DataFrame(columns)
        clock = clock_of(table) if len(table.columns) > 1 else None
        if clock is not None and clock.good.any():
            return _dated(table, clock.column)
    return None


def _columns(name: str, array: NDArray[Any], length: int) -> Iterator[tuple[str, NDArray[Any]]]:
    if array.ndim == 1:
        if len(array) == length:
            yield name, array
        return
    matrix = array if array.shape[0] == length else array.T
    if matrix.shape[0] == length and matrix.shape[1] <= MOST_COLUMNS:
        yield from ((f"{name}[{i}]", matrix[:, i]) for i in range(matrix.shape[1]))


def _dated(table: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return the table with MATLAB's day numbers turned into seconds since 1970."""
    if column not in table:
        return table
    days = table[column].to_numpy(float)
    finite = days[np.isfinite(days)]
    steps = np.abs(np.diff(finite))
    if len(steps) and FIRST_DAY < np.median(finite) < LAST_DAY and np.median(steps) < 0.01:
        return table.assign(**{column: (days - DAY_OF_1970) * 86_400.0})
    return table


MATLAB = Reader("matlab", (".mat",), sniff, read)
