"""Where searches ended, held against each other, and whether they go on."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from identify.output_error import Solution

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Costs no farther apart than this are the same.
THE_SAME = 0.5
#: Steps from another begin before it is held against the base's own, and more where the last of them promise much:
#: where it brought the cost down to less than this share, and not farther off than so many times the base's.
BRIEFLY, MORE, HALF, NEARLY = 2, 8, 0.5, 10.0


def total(solution: Solution) -> float:
    """Cost with what was known beforehand; infinite where the prediction ran away."""
    return solution.total if np.isfinite(solution.total) else np.inf


def nearest(ends: Sequence[Solution]) -> Solution:
    """The best of where searches ended; of those that are as good, one that ended at no bound."""
    least = min(map(total, ends))
    alike = [s for s in ends if total(s) <= least + THE_SAME]
    return min(alike, key=lambda s: bool(s.held.any()))


def fallen(search: Callable[..., Solution], start: tuple[FloatArray, FloatArray], base: float) -> Solution:
    """Where a few steps from a start lead, and some more of a search that still falls fast to a base's cost."""
    first = search(*start, budget=BRIEFLY - 1)
    found = search(first.p, first.first, budget=1)
    if not total(found) < min(HALF * total(first), NEARLY * base):
        return found
    return search(found.p, found.first, budget=MORE)
