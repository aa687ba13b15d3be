"""Fewer points for a plot, with every extreme kept."""

from __future__ import annotations

import numpy as np

from preprocess.trial import FloatArray

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def extremes(value: FloatArray, most: int) -> IntArray:
    """Rows to draw so that the picture of a long series stays the same.

    The series is cut into buckets of equal count; of each the smallest and the largest value are kept, and
    the series' first and last row. A bucket without any finite value keeps its first row: gaps stay gaps.

    Parameters
    ----------
    value : (n,)
        The series; NaN where there is none.
    most : int
        About how many rows to keep, at least 4; a shorter series is kept whole.

    Returns
    -------
    (m,) int
        Increasing row numbers, m ≤ most + 2.
    """
    n = len(value)
    if n <= most:
        return np.arange(n)
    size = -(-n // max(1, most // 2))
    padded = np.full(-(-n // size) * size, np.nan)
    padded[:n] = value
    buckets = padded.reshape(-1, size)
    low = np.where(np.isnan(buckets), np.inf, buckets).argmin(axis=1)
    high = np.where(np.isnan(buckets), -np.inf, buckets).argmax(axis=1)
    first = np.arange(len(buckets)) * size
    kept = np.zeros(n, bool)
    kept[np.concatenate([[0, n - 1], first + low, first + high])] = True
    return np.flatnonzero(kept)


def even(n: int, most: int) -> IntArray:
    """About ``most`` row numbers, evenly spread over ``n`` rows, ends included."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(np.int64)) if n else np.arange(0)
