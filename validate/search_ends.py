"""Where searches ended, held against each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.output_error import Solution

#: Costs no farther apart than this are the same.
THE_SAME = 0.5


def total(solution: Solution) -> float:
    """Cost with what was known beforehand; infinite where the prediction ran away."""
    return solution.total if np.isfinite(solution.total) else np.inf


def nearest(ends: Sequence[Solution]) -> Solution:
    """The best of where searches ended; of those that are as good, one that ended at no bound."""
    least = min(map(total, ends))
    alike = [s for s in ends if total(s) <= least + THE_SAME]
    return min(alike, key=lambda s: bool(s.held.any()))
