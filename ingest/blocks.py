"""Blocks of records that stand in the wrong place of a table: put together in order, they are one recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ingest.clock import GAP_FACTOR, GAP_NS, RESTART_NS


def fit_together(t_ns: NDArray[np.int64]) -> bool:
    """Whether times that go back do so only because blocks of them were moved, each of which fits its gap.

    A clock that restarts tells times that were told before, or others far from them; blocks that somebody moved lie
    side by side, each as far from the next as records are.

    Parameters
    ----------
    t_ns : (n,) int64
        Times in the order of recording.
    """
    steps = np.diff(t_ns)
    if not (steps < -RESTART_NS).any():
        return False
    gap = max(GAP_FACTOR * float(np.median(steps[steps > 0])), GAP_NS) if (steps > 0).any() else GAP_NS
    begins = np.append(0, np.flatnonzero((steps < -RESTART_NS) | (steps > gap)) + 1)
    first, last = (f.reduceat(t_ns, begins) for f in (np.minimum, np.maximum))
    order = np.argsort(first)
    apart = first[order][1:] - last[order][:-1]
    moved = np.diff(order) != 1
    return bool((apart > 0).all() and (apart[moved] <= gap).all())
