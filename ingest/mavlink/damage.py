"""Stretches of a file that no record covers, as findings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ingest.log import Finding

#: So many stretches are reported one by one; the rest in one sum.
MOST = 10_000


def uncovered(
    start: NDArray[np.int64], end: NDArray[np.int64], size: int, begin: int = 0
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Offsets and lengths of what records from ``start`` to ``end`` leave over in ``begin``…``size``."""
    left = np.concatenate([np.array([begin], dtype=np.int64), end])
    right = np.concatenate([start, np.array([size], dtype=np.int64)])
    open_ = right > left
    return left[open_], (right - left)[open_]


def damage_findings(
    offset: NDArray[np.int64], length: NDArray[np.int64], size: int, cut: bool
) -> list[Finding]:
    """One finding per stretch.

    Parameters
    ----------
    offset, length : (n,) int
    size : int
        Length of the file.
    cut : bool
        Whether a stretch that reaches the end of the file looks like a record that was cut off.
    """
    findings = [damaged(int(o), int(n), size, cut) for o, n in zip(offset[:MOST], length[:MOST], strict=True)]
    if len(offset) > MOST:
        rest = int(length[MOST:].sum())
        message = f"{len(offset) - MOST} more damaged stretches of {rest} bytes in all"
        findings.append(Finding("damaged", message, int(offset[MOST]), rest, count=len(offset) - MOST))
    return findings


def damaged(offset: int, length: int, size: int, cut: bool) -> Finding:
    """One damaged stretch."""
    if cut and offset + length == size:
        return Finding("truncated", f"the last record is cut off after {length} bytes", offset, length)
    return Finding("damaged", f"{length} bytes that are no record", offset, length)
