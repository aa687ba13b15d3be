"""Stretches of a file that no record covers, as findings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ingest.log import Finding

Integers = NDArray[np.int64]
#: More stretches than this become one finding: a file of noise must not become a million objects.
MOST = 1000


def damage_findings(
    spans: Sequence[tuple[int, int]] | Integers, size: int, what: str = "no record"
) -> tuple[Finding, ...]:
    """One finding per damaged stretch.

    Parameters
    ----------
    spans : (n, 2) int
        Offset and length of each stretch, in order.
    size : int
        Of the file: a stretch that reaches its end is a truncation.
    what : str
        What is wrong with it.
    """
    told = [damaged(int(offset), int(length), size, what) for offset, length in spans[:MOST]]
    rest = spans[MOST:]
    if len(rest):
        length = sum(int(n) for _, n in rest)
        message = f"{len(rest)} more damaged stretches of {length} bytes in all"
        told.append(Finding("damaged", message, int(rest[0][0]), length, count=len(rest)))
    return tuple(told)


def damaged(offset: int, length: int, size: int, what: str) -> Finding:
    """One damaged stretch."""
    if offset + length >= size:
        return Finding(
            "truncated", f"the file ends within a record, after {length} bytes of it", offset, length
        )
    return Finding("damaged", f"{length} bytes that are {what}", offset, length)


def uncovered(start: Integers, end: Integers, size: int, begin: int = 0) -> tuple[Integers, Integers]:
    """Offsets and lengths of what records from ``start`` to ``end`` leave over in ``begin``…``size``."""
    left = np.concatenate([np.array([begin], dtype=np.int64), end])
    right = np.concatenate([start, np.array([size], dtype=np.int64)])
    open_ = right > left
    return left[open_], (right - left)[open_]


def merged(spans: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Stretches in order of offset, those that touch joined."""
    out: list[tuple[int, int]] = []
    for offset, length in sorted(spans):
        if out and offset <= out[-1][0] + out[-1][1]:
            start = out[-1][0]
            out[-1] = (start, max(out[-1][1], offset + length - start))
        else:
            out.append((offset, length))
    return out
