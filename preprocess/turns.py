"""Whole turns that a vessel made while nothing told its heading, from its yaw rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from preprocess.judge import Judged
from preprocess.trial import FloatArray

#: Less than this between two headings, rad, and the shorter way round is the way that was turned.
NEARLY_HALF = 2.0
#: The yaw rate tells from so many samples on between two headings, no two of them farther apart than this share of it.
TELLS, APART = 5, 0.25


def with_turns(judged: Mapping[str, Judged]) -> dict[str, Judged]:
    """The sensors' samples, the heading moved by the whole turns that the yaw rate tells between its samples.

    A compass that is silent for some seconds is unwrapped by the shorter way round, which is the wrong one where the
    vessel turned by more than half a turn meanwhile.
    """
    heading, gyro = judged.get("heading"), judged.get("yaw_rate")
    if heading is None or gyro is None or gyro.good.sum() < TELLS:
        return dict(judged)
    use = np.flatnonzero(heading.good)
    t, value = heading.raw.t[use], heading.raw.value[use]
    rate_t, rate = gyro.raw.t[gyro.good], gyro.raw.value[gyro.good]
    turned = np.diff(_turned(t, rate_t, rate))
    turns = np.rint((turned - np.diff(value)) / (2.0 * np.pi))
    turns[np.abs(turned) < NEARLY_HALF] = 0.0
    for k in np.flatnonzero(turns):
        turns[k] *= _told(t[k], t[k + 1], rate_t)
    if not turns.any():
        return dict(judged)
    all_turns = np.zeros(len(heading.raw.t))
    all_turns[use[1:]] = turns
    raw = replace(heading.raw, value=heading.raw.value + 2.0 * np.pi * np.cumsum(all_turns))
    return {**judged, "heading": replace(heading, raw=raw)}


def _turned(t: FloatArray, rate_t: FloatArray, rate: FloatArray) -> FloatArray:
    """Integral (n,) of the yaw rate to the times ``t`` (n,), rad."""
    steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(rate_t)
    return np.asarray(np.interp(t, rate_t, np.r_[0.0, np.cumsum(steps)]), dtype=float)


def _told(begin: float, end: float, rate_t: FloatArray) -> bool:
    """Whether the yaw rate was measured often enough between two headings."""
    first, last = int(np.searchsorted(rate_t, begin, side="right")) - 1, int(np.searchsorted(rate_t, end))
    if first < 0 or last >= len(rate_t) or last - first <= TELLS:
        return False
    return bool(np.diff(rate_t[first : last + 1]).max() < APART * (end - begin))
