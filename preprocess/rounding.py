"""To what step values were rounded."""

from __future__ import annotations

import numpy as np

from preprocess.trial import FloatArray


def resolution(value: FloatArray) -> float:
    """Return the step to which values were rounded, the largest of their columns'; 0 where none shows.

    Parameters
    ----------
    value : (n,) or (n, m)
    """
    if not len(value):
        return 0.0
    columns = np.reshape(value, (len(value), -1)).T
    return max((_step(c) for c in columns), default=0.0)


def _step(column: FloatArray) -> float:
    """Return the smallest change, if nearly all changes are whole multiples of it, and not all one."""
    every = np.abs(np.diff(column))
    change = every[every > 1e-12]
    if len(change) < 20:
        return 0.0
    smallest = float(np.percentile(change, 1.0))
    quantum = float(np.median(change[change < 1.5 * smallest]))
    ratio = change[change < 200.0 * quantum] / quantum
    off = np.abs(ratio - np.round(ratio))
    whole = np.mean(off < 0.02 * np.maximum(ratio, 1.0)) > 0.9 and np.median(ratio) < 50.0
    varied = np.ptp(np.round(ratio)) >= 1.0 or len(change) < 0.98 * len(every)
    return quantum if whole and varied else 0.0
