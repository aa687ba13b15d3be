"""To what step values were rounded."""

from __future__ import annotations

import numpy as np

from preprocess.trial import FloatArray


def resolution(value: FloatArray) -> float:
    """Return the step to which values were rounded; 0 where none shows.

    The smallest change between neighbours, if nearly all changes are whole multiples of it.
    """
    change = np.abs(np.diff(value, axis=0)).ravel()
    change = change[change > 1e-12]
    if len(change) < 20:
        return 0.0
    quantum = float(np.percentile(change, 1.0))
    near = change[change < 1.5 * quantum]
    quantum = float(np.median(near))
    ratio = change[change < 200.0 * quantum] / quantum
    off = np.abs(ratio - np.round(ratio))
    return quantum if np.mean(off < 0.02 * np.maximum(ratio, 1.0)) > 0.9 and np.median(ratio) < 50.0 else 0.0
