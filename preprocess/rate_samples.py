"""What the samples of a rate themselves say of a wander of it: whether it may be hidden in them, or shows."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from preprocess.integrated import Sensed

#: What a rate's wander adds up to counts from this share of what its white noise does.
COUNTS = 0.5
#: By more than so many times its white noise two samples of a rate do not differ because it wanders.
SHARP = 1.2
#: Second differences over so many time constants, and twice as many, have all of a wander in them.
LAG = 2.0
#: Of what a wander adds to them at least the first share is there, and no more than the second, or the vessel moved.
THERE = (0.5, 1.5)
#: They tell anything where a wander adds more than so many of their own standard errors.
TELLING = 4.0


def may_wander(rates: Sequence[Sensed], size: float, time: float) -> bool:
    """Whether a rate may wander so: by something, and by no more than its samples differ by."""
    counts = 2.0 * size**2 * time > COUNTS * min(r.sigma**2 * r.every for r in rates)
    change = [size * math.sqrt(-math.expm1(-r.every / time)) for r in rates]
    hidden = all(c < SHARP * r.sigma for c, r in zip(change, rates, strict=True))
    there = _share(rates, size, time, LAG * time)
    return counts and hidden and (there is None or there >= THERE[0])


def shows(rates: Sequence[Sensed], size: float, time: float) -> bool:
    """Whether the samples differ by as much as such a wander makes them, and by no more over longer times."""
    shares = [_share(rates, size, time, times * LAG * time) for times in (1.0, 2.0)]
    return all(s is not None and THERE[0] <= s <= THERE[1] for s in shares)


def _share(rates: Sequence[Sensed], size: float, time: float, lag: float) -> float | None:
    """How much of what a wander adds to second differences over a ``lag``, s, is there; None where they cannot tell."""
    seen = due = doubt = 0.0
    for rate in (r for r in rates if len(r.t) > 2):
        (near, count), (far, left) = _bend(rate, rate.every), _bend(rate, lag)
        if min(count, left):
            seen += left * (far - near)
            due += left * size**2 * (_bent(lag / time) - _bent(rate.every / time))
            doubt += 2.0 * left * far**2 * max(1.0, lag / rate.every)
    return seen / due if due > TELLING * math.sqrt(doubt) else None


def _bend(rate: Sensed, lag: float) -> tuple[float, int]:
    """Mean square of second differences over a lag, a sixth of it (white noise's variance), and how many there are."""
    k = max(1, round(lag / rate.every))
    even = np.abs(rate.t[2 * k :] - rate.t[: -2 * k] - 2.0 * k * rate.every) < 0.5 * rate.every
    bend = (rate.value[2 * k :] - 2.0 * rate.value[k:-k] + rate.value[: -2 * k])[even]
    return (float(np.mean(bend**2)) / 6.0, len(bend)) if len(bend) else (0.0, 0)


def _bent(lags: float) -> float:
    """The same of first-order Gauss-Markov noise of unit variance, over a lag in time constants."""
    return 1.0 - 4.0 / 3.0 * math.exp(-lags) + math.exp(-2.0 * lags) / 3.0
