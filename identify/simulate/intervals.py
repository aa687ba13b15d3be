"""What the draws from the parameters' covariance say of a measure, and when they say nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.simulate.measures import UNITS, Measure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Share of the draws that may be missing: the rest of more is a choice of the tame ones, and their spread too small.
FEW = 0.05
#: Fewer draws than this have no spread.
LEAST = 10


@dataclass(frozen=True)
class Draws:
    """The same manoeuvre with parameters drawn from their covariance.

    Attributes
    ----------
    values : mapping of str to (k,)
        Every measure in every draw; NaN where a draw failed or did not come so far.
    tracks : (n, m, 2)
        Tracks of some of those that did not fail; NaN after their end.
    count, failed : int
        Draws, and those of them that ran away or did not come to the first measure.
    linear : bool
        The values are what their slopes make of the draws: too many whole ones failed.
    positive : frozenset of str
        Measures whose interval to first order ends at nothing.
    """

    values: Mapping[str, FloatArray]
    tracks: FloatArray
    count: int
    failed: int
    linear: bool = False
    positive: frozenset[str] = frozenset()

    @property
    def failed_share(self) -> float:
        """Share of the draws that failed."""
        return self.failed / max(self.count, 1)


def measure_of(
    name: str, value: float, draws: FloatArray, limit: float | None, least: float = -math.inf
) -> Measure:
    """A measure with its interval: none where it was not reached, or too many draws (k,) are missing.

    The interval holds its value: where the draws of a skew measure (a width is never negative) lie to one side of it,
    it reaches as far as the value. It does not reach below the ``least``.
    """
    there = draws[np.isfinite(draws)]
    if not math.isfinite(value) or len(there) < LEAST or _too_few(draws):
        return Measure(name, value, UNITS[name], limit=limit)
    low, high = np.maximum(np.percentile(there, [2.5, 97.5]), least)
    spread = float(there.std(ddof=1))
    return Measure(name, value, UNITS[name], spread, min(float(low), value), max(float(high), value), limit)


def _too_few(draws: FloatArray) -> bool:
    return _missing(draws) > FEW * len(draws)


def _missing(draws: FloatArray) -> int:
    return int(np.count_nonzero(~np.isfinite(draws)))


def remarks(draws: Draws, measures: Sequence[Measure]) -> list[str]:
    """What draws that failed mean for the measures, as sentences."""
    if not draws.failed > FEW * draws.count:
        return [*_few_failed(draws), *_not_so_far(draws, measures)]
    if draws.linear:
        return [_to_first_order(draws), *_not_so_far(draws, measures)]
    said = f"{_begin(draws)}: the uncertainty is larger than can be said, and no interval is given."
    return [said, *_most_failed(draws)]


def _begin(draws: Draws) -> str:
    return f"{draws.failed} of {draws.count} draws from the parameters' covariance could not be sailed"


def _few_failed(draws: Draws) -> list[str]:
    return [f"{_begin(draws)}; the intervals are those of the rest."] if draws.failed else []


def _to_first_order(draws: Draws) -> str:
    return (
        f"{_begin(draws)}: the intervals are those of small draws, made larger in proportion, as the standard errors "
        "account for logs left out. They say nothing of a vessel that runs away."
    )


def _most_failed(draws: Draws) -> list[str]:
    if not 2 * draws.failed > draws.count:
        return []
    return [
        "Most models that agree with the logs as well as this one does cannot sail this manoeuvre: do not rely on its "
        "measures. Logs of more and larger manoeuvres would say more, or a model with fewer terms."
    ]


def _not_so_far(draws: Draws, measures: Sequence[Measure]) -> list[str]:
    """Measures without an interval, since some of the draws stop short of them."""
    short = [
        f"{m.name.replace('_', ' ')} ({_missing(draws.values[m.name])} of {draws.count})"
        for m in measures
        if math.isfinite(m.value) and m.name in draws.values and _too_few(draws.values[m.name])
    ]
    return [f"No interval, since draws did not come so far: {', '.join(short)}."] if short else []
