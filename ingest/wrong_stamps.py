"""Single time stamps that are damaged: they jump away from their neighbours and are back soon."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

#: A step larger than this, either way, is a jump.
JUMP_NS = 1_000_000_000
#: As many records with a wrong stamp in a row are taken for damage; more are a clock that was set.
MOST_WRONG = 3
#: A wrong stamp at an end of the log shows only by its distance.
FAR_NS = 60 * 1_000_000_000
#: No log spans more than this before and after its middle.
SPAN_NS = 200 * 86_400 * 1_000_000_000


def wrong_stamps(time_ns: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Records whose stamp jumps away from those before and is back soon; (n,) bool."""
    if not len(time_ns):
        return np.zeros(0, np.bool_)
    absurd = np.abs(time_ns.astype(np.float64) - np.median(time_ns)) > SPAN_NS
    if absurd.any():
        wrong = absurd.copy()
        wrong[~absurd] = wrong_stamps(time_ns[~absurd])
        return wrong
    wrong = np.zeros(len(time_ns), np.bool_)
    steps = np.diff(time_ns)
    jumps = (np.flatnonzero(np.abs(steps) > JUMP_NS) + 1).tolist()
    for i, j in pairwise(jumps):
        away, back = int(steps[i - 1]), int(steps[j - 1])
        returned = abs(int(time_ns[j]) - int(time_ns[i - 1])) < min(abs(away), abs(back)) // 2
        if j - i <= MOST_WRONG and (away > 0) != (back > 0) and returned and not wrong[i - 1]:
            wrong[i:j] = True
    if jumps and len(time_ns) > 4 * MOST_WRONG:
        first, last = jumps[0], jumps[-1]
        wrong[:first] |= first <= MOST_WRONG and abs(int(steps[first - 1])) > FAR_NS
        wrong[last:] |= len(time_ns) - last <= MOST_WRONG and abs(int(steps[last - 1])) > FAR_NS
    return wrong
