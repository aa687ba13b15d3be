"""Whole turns that a vessel made while nothing told its heading, from its yaw rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from preprocess.judge import Judged
from preprocess.outliers import sliding_three_sigma
from preprocess.trial import BoolArray, FloatArray

#: Less than this between two headings, rad, and the shorter way round is the way that was turned.
NEARLY_HALF = 2.0
#: The yaw rate tells from so many samples on between two headings, no two of them farther apart than this share of it.
TELLS, APART = 5, 0.25
#: Rates and what their ends miss, but for the largest few; where only a compass tells rates, over so many s.
MOSTLY, OVER = 0.99, 1.0
#: No compass says more often than this anything new, s.
FASTEST = 1e-3
#: Samples so many local spreads off are wild.
WILD = 6.0
#: Gaps are held against others of the same length to within this ratio, at so many places of the log.
ALIKE, PLACES = 1.25, 1000


@dataclass(frozen=True)
class _Turning:
    """How fast a vessel turned: ``rate`` (n,) at ``t`` (n,), its integral ``angle`` (n,), rad."""

    t: FloatArray
    rate: FloatArray
    angle: FloatArray

    def turned(self, t: FloatArray) -> FloatArray:
        """The integral (m,) up to times (m,); across what was not measured with the mean of the rates beside it."""
        return np.asarray(np.interp(t, self.t, self.angle), dtype=float)

    def tells(self, begin: float, end: float) -> bool:
        """Whether rates were measured often enough between two headings."""
        first, last = int(np.searchsorted(self.t, begin, side="right")) - 1, int(np.searchsorted(self.t, end))
        if first < 0 or last >= len(self.t) or last - first <= TELLS:
            return False
        return bool(np.diff(self.t[first : last + 1]).max() < APART * (end - begin))

    def missed(self, lasting: float) -> float:
        """What the rates at both ends miss of the turning between them, rad: in such gaps elsewhere, mostly less."""
        latest = self.t[-1] - lasting
        if not latest > self.t[0]:
            return np.inf
        a = np.linspace(self.t[0], latest, PLACES)
        b = a + lasting
        rates = np.interp(a, self.t, self.rate) + np.interp(b, self.t, self.rate)
        return float(np.quantile(np.abs(self.turned(b) - self.turned(a) - 0.5 * lasting * rates), MOSTLY))


def with_turns(judged: Mapping[str, Judged]) -> dict[str, Judged]:
    """The sensors' samples, the heading moved by the whole turns that were made between its samples, as far as told.

    A compass that is silent for some seconds is unwrapped by the shorter way round, which is the wrong one where the
    vessel turned by more than half a turn meanwhile.
    """
    heading, turning = judged.get("heading"), _turning(judged)
    if heading is None or turning is None:
        return dict(judged)
    use = np.flatnonzero(heading.good)
    t, value = heading.raw.t[use], heading.raw.value[use]
    turned = np.diff(turning.turned(t))
    turns = np.rint((turned - np.diff(value)) / (2.0 * np.pi))
    turns[(np.abs(turned) < NEARLY_HALF) | _hidden(turning, t, turns != 0.0)] = 0.0
    if not turns.any():
        return dict(judged)
    all_turns = np.zeros(len(heading.raw.t))
    all_turns[use[1:]] = turns
    raw = replace(heading.raw, value=heading.raw.value + 2.0 * np.pi * np.cumsum(all_turns))
    return {**judged, "heading": replace(heading, raw=raw)}


def untold(judged: Mapping[str, Judged]) -> BoolArray:
    """Which steps (n - 1,) between good headings may hide turns that nothing tells."""
    heading, turning = judged["heading"], _turning(judged)
    t = heading.raw.t[heading.good]
    if turning is None:
        return np.zeros(max(0, len(t) - 1), dtype=bool)
    fastest = float(np.quantile(np.abs(turning.rate), MOSTLY))
    return _hidden(turning, t, np.diff(t) * fastest > NEARLY_HALF)


def _hidden(turning: _Turning, t: FloatArray, asked: BoolArray) -> BoolArray:
    """Of the steps (n - 1,) between headings at ``t`` (n,) that are ``asked`` those whose turning nothing tells."""
    missed = lru_cache(maxsize=None)(lambda k: turning.missed(ALIKE**k))
    out = asked.copy()
    for k in np.flatnonzero(asked):
        alike = math.ceil(math.log(t[k + 1] - t[k], ALIKE))
        out[k] = not turning.tells(t[k], t[k + 1]) and missed(alike) > NEARLY_HALF
    return out


def _turning(judged: Mapping[str, Judged]) -> _Turning | None:
    """How fast the vessel turned: by its yaw rate, or by what its heading changes where that is told often enough."""
    gyro, heading = (_believed(judged.get(k)) for k in ("yaw_rate", "heading"))
    if len(gyro[0]) >= TELLS:
        return _integrated(*gyro)
    t, psi = heading
    if len(t) < TELLS:
        return None
    apart = max(1, math.ceil(OVER / max(float(np.median(np.diff(t))), FASTEST)))
    if len(t) < apart + TELLS:
        return None
    lasts = t[apart:] - t[:-apart]
    whole = lasts < 2.0 * max(OVER, float(np.median(lasts)))
    if whole.sum() < TELLS:
        return None
    return _integrated((0.5 * (t[apart:] + t[:-apart]))[whole], ((psi[apart:] - psi[:-apart]) / lasts)[whole])


def _believed(judged: Judged | None) -> tuple[FloatArray, FloatArray]:
    """Times and values (n,) of the good samples that are no wild ones; none of a sensor that is not there."""
    if judged is None:
        return np.zeros(0), np.zeros(0)
    t, value = judged.raw.t[judged.good], judged.raw.value[judged.good]
    wild = sliding_three_sigma(t, value, k=WILD)
    return t[~wild], value[~wild]


def _integrated(t: FloatArray, rate: FloatArray) -> _Turning:
    return _Turning(t, rate, np.r_[0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])
