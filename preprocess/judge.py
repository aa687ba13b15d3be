"""Which samples can be believed: receiver flags, repeated values, jumps; each with the reason kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from preprocess.raw import Raw
from preprocess.rounding import resolution
from preprocess.trial import BoolArray, FloatArray


@dataclass(frozen=True)
class Judged:
    """Samples with the verdict on each.

    Attributes
    ----------
    raw : Raw
        Heading unwrapped.
    good : (n,) bool
    reasons : mapping of str to int
    floor : float
        Standard deviation of the rounding, SI.
    """

    raw: Raw
    good: BoolArray
    reasons: Mapping[str, int] = field(default_factory=dict)
    floor: float = 0.0


def judge(raw: Raw) -> Judged:
    """Judge the samples of a sensor by themselves (not against the other sensors)."""
    if raw.quantity == "heading":
        raw = replace(raw, value=robust_unwrap(raw.value))
    quantum = raw.quantum or resolution(raw.value)
    again = repeated(raw.value, quantum) & ~raw.flagged
    reasons = {"flagged": int(raw.flagged.sum()), "repeated": int(again.sum())}
    good = ~(raw.flagged | again)
    return Judged(raw, good, {k: n for k, n in reasons.items() if n}, quantum / np.sqrt(12.0))


def robust_unwrap(angle: FloatArray) -> FloatArray:
    """Unwrap along a running median of the direction, so that an outlier cannot add a turn; rad."""
    from scipy.ndimage import median_filter

    from preprocess.frames import nearest_turn

    if len(angle) < 5:
        return np.unwrap(angle)
    c, s = (median_filter(f(angle), size=5, mode="nearest") for f in (np.cos, np.sin))
    return nearest_turn(angle, np.unwrap(np.arctan2(s, c)))


def repeated(value: FloatArray, quantum: float) -> BoolArray:
    """Return samples that only repeat the one before although the quantity moved on; (n,) bool.

    A value that stays for several samples and then jumps by more than two steps of its resolution was not
    measured anew; one that stays because nothing moves was.
    """
    n = len(value)
    same = np.zeros(n, dtype=bool)
    if n < 3:
        return same
    flat = value.reshape(n, -1)
    change = np.abs(np.diff(flat, axis=0)).max(axis=1)
    same[1:] = change == 0.0
    if not same.any():
        return same
    first = np.flatnonzero(~same)
    run = np.cumsum(~same) - 1
    jump = np.abs(np.diff(flat[first], axis=0)).max(axis=1)
    around = np.maximum(np.r_[0.0, jump], np.r_[jump, 0.0])
    return np.asarray(same & (around[run] > 2.5 * quantum), bool)
