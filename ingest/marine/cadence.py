"""Times of records that state none, from their order among those that do.

A record arrived after the last record of an epoch's time before it and before the first of the next: bounds. Where a
device sends at a regular rate, one line through all its bounds is known far better than any of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Records that a line is drawn through at least; longer stretches that no line fits are halved down to so many.
LEAST, SMALLEST = 4, 64
#: By how much of an interval a line may miss a bound: queues and rounded stamps; in the shortest stretches.
MISSED, MISSED_MOST = 0.1, 0.25
#: Share of the records at which others may have been lost.
LOST = 0.02
#: Intervals without a record after which counting begins anew.
GAP = 1.4
#: Steps of the search for a slope, each to 0.618 of the bracket.
SEARCH = 35
#: … for the ends of the slopes that fit, and slopes between them over which the mean is taken.
BISECTIONS, SLOPES = 20, 31
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


def by_rate(lower: Floats, upper: Floats, rough: Floats) -> tuple[Floats, Floats]:
    """Times of the records of one kind where they come at a regular rate, NaN elsewhere.

    Parameters
    ----------
    lower, upper : (n,)
        Between which each came, in the order of arrival; infinite where nothing bounds it.
    rough : (n,)
        Times from the counts per epoch alone.

    Returns
    -------
    times, unsure : (n,)
        In the unit of the bounds; all of a stretch may be early or late together by ``unsure``: as an even
        distribution of this half width.

    Notes
    -----
    In a stretch, the mean of all lines t = a + b k between the bounds is taken, each as likely as any other. Where none
    fits, records may have been lost, which shifts the count: then the count by ``rough`` is tried.
    """
    times, unsure = np.full(len(lower), np.nan), np.zeros(len(lower))
    usual = float(np.median(np.diff(rough))) if len(rough) >= LEAST else 0.0
    if usual <= 0.0:
        return times, unsure
    cuts = 1 + np.flatnonzero(lower[1:] - upper[:-1] > GAP * usual)
    open_ = [slice(a, b) for a, b in pairwise([0, *cuts.tolist(), len(lower)])]
    while open_:
        part = open_.pop()
        found = _on_a_line(lower[part], upper[part], rough[part], usual)
        if found is not None:
            times[part], unsure[part] = found
        elif part.stop - part.start >= 2 * SMALLEST:
            middle = (part.start + part.stop) // 2
            open_ += [slice(part.start, middle), slice(middle, part.stop)]
    return times, unsure


def _on_a_line(lower: Floats, upper: Floats, rough: Floats, usual: float) -> tuple[Floats, float] | None:
    """Times on the lines that fit, by plain count or else by ``rough``, and ``unsure``; None where none fits."""
    bounded = np.isfinite(lower) & np.isfinite(upper)
    if bounded.sum() < LEAST:
        return None
    first = float(lower[bounded][0])
    most = MISSED_MOST if len(lower) < 2 * SMALLEST else MISSED
    for count in _counts(rough, usual):
        between = _Between(lower - first, upper - first, count)
        low, high = between.slopes(bounded)
        deepest = _highest(between.depth, low, high)
        if deepest > 0.0 and between.depth(deepest) >= -most * deepest:
            middle, slope, unsure = between.mean(low, deepest, high)
            return first + middle + slope * count, unsure
    return None


def _counts(rough: Floats, usual: float) -> list[Floats]:
    """Numbers of the records about their middle: one by one; and leaving out those that ``rough`` says were lost."""
    plain = np.arange(len(rough), dtype=float)
    told = np.rint((rough - rough[0]) / usual)
    lost = np.diff(told) - 1.0
    some = bool((lost >= 0).all()) and 0 < (lost > 0).sum() <= LOST * len(rough)
    return [k - k.mean() for k in ([plain, told] if some else [plain])]


@dataclass(frozen=True)
class _Between:
    """Lines a + b k between bounds ``lower`` and ``upper`` (n,) at ``count`` (n,), of mean zero."""

    lower: Floats
    upper: Floats
    count: Floats

    def edges(self, slope: float) -> tuple[float, float]:
        """The lowest and highest a."""
        return float(np.max(self.lower - slope * self.count)), float(np.min(self.upper - slope * self.count))

    def depth(self, slope: float) -> float:
        """How much room there is for a: concave in the slope; negative where there is none."""
        low, high = self.edges(slope)
        return high - low

    def slopes(self, bounded: NDArray[np.bool_]) -> tuple[float, float]:
        """Slopes beyond which no line fits, by the first and last bounds."""
        a, b = np.flatnonzero(bounded)[[0, -1]]
        span = float(self.count[b] - self.count[a])
        steepest = float(self.upper[b] - self.lower[a]) / span
        return max(float(self.lower[b] - self.upper[a]) / span, 0.0), steepest

    def mean(self, low: float, deepest: float, high: float) -> tuple[float, float, float]:
        """Mean a and b of all lines that fit, each as likely, and √3 standard deviations of their times."""
        if self.depth(deepest) <= 0.0:
            return 0.5 * sum(self.edges(deepest)), deepest, 0.0
        flat, steep = (_edge(self.depth, deepest, beyond) for beyond in (low, high))
        b = np.linspace(flat, steep, SLOPES) if steep > flat else np.array([deepest])
        below, above = np.array([self.edges(x) for x in b]).T
        a, room = 0.5 * (below + above), np.maximum(above - below, 0.0)
        share = room / room.sum() if room.sum() > 0.0 else np.full(len(b), 1.0 / len(b))
        middle, slope = float(share @ a), float(share @ b)
        turned = float(share @ (b - slope) ** 2) * float(np.mean(self.count**2))
        variance = share @ (room**2 / 12.0 + (a - middle) ** 2) + turned
        return middle, slope, float(np.sqrt(3.0 * variance))


def _edge(function: Callable[[float], float], inside: float, outside: float) -> float:
    """Where a function that is positive inside falls to zero on the way outside, by bisection."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if function(middle) > 0.0 else (inside, middle)
    return inside


def _highest(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a concave function is largest between two places, by golden sections (Kiefer 1953)."""
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = function(left), function(right)
    for _ in range(SEARCH):
        if at_left < at_right:
            low, left, at_left = left, right, at_right
            right = low + GOLDEN * (high - low)
            at_right = function(right)
        else:
            high, right, at_right = right, left, at_left
            left = high - GOLDEN * (high - low)
            at_left = function(left)
    return 0.5 * (low + high)
