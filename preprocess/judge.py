"""Which samples can be believed: receiver flags, repeated values, jumps; each with the reason kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from preprocess.raw import Raw
from preprocess.trial import BoolArray, FloatArray, Measurement


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
    quantum = resolution(raw.value)
    again = repeated(raw.value, quantum) & ~raw.flagged
    reasons = {"flagged": int(raw.flagged.sum()), "repeated": int(again.sum())}
    good = ~(raw.flagged | again)
    return Judged(raw, good, {k: n for k, n in reasons.items() if n}, quantum / np.sqrt(12.0))


def judge_input(raw: Raw) -> Measurement:
    """Judge the samples of an input."""
    step = float(np.median(np.diff(raw.t))) if len(raw.t) > 1 else 0.0
    good = np.ones(len(raw.t), dtype=bool)
    return Measurement(raw.quantity, raw.t, raw.value, 0.0, good, raw.source.name, {}, step, holds(raw.value))


def holds(value: FloatArray) -> bool:
    """Whether an input's values are steps that hold, rather than a motion."""
    change = np.diff(value) != 0.0
    if len(change) < 3 or not change.any():
        return True
    alone = change[1:-1] & ~change[:-2] & ~change[2:]
    return bool(change.mean() < 0.5 and alone.sum() > 0.5 * change.sum())


def robust_unwrap(angle: FloatArray) -> FloatArray:
    """Unwrap along a running median of the direction, so that an outlier cannot add a turn; rad."""
    from scipy.ndimage import median_filter

    from preprocess.frames import nearest_turn

    if len(angle) < 5:
        return np.unwrap(angle)
    c, s = (median_filter(f(angle), size=5, mode="nearest") for f in (np.cos, np.sin))
    return nearest_turn(angle, np.unwrap(np.arctan2(s, c)))


def resolution(value: FloatArray) -> float:
    """The step to which values were rounded; 0 where none shows.

    The smallest change between neighbours, if nearly all changes are whole multiples of it.
    """
    change = np.abs(np.diff(value, axis=0)).ravel()
    change = change[change > 1e-12]
    if len(change) < 20:
        return 0.0
    quantum = float(np.percentile(change, 1.0))
    near = change[change < 1.5 * quantum]
    quantum = float(np.median(near))
    ratio = change[change < 200.0 * quantum] / quantum
    off = np.abs(ratio - np.round(ratio))
    return quantum if np.mean(off < 0.02 * np.maximum(ratio, 1.0)) > 0.9 and np.median(ratio) < 50.0 else 0.0


def repeated(value: FloatArray, quantum: float) -> BoolArray:
    """Samples that only repeat the one before although the quantity moved on; (n,) bool.

    A value that stays for several samples and then jumps by more than two steps of its resolution was not measured
    anew; one that stays because nothing moves was.
    """
    n = len(value)
    flat = value.reshape(n, -1)
    same = np.zeros(n, dtype=bool)
    if n < 3:
        return same
    change = np.abs(np.diff(flat, axis=0)).max(axis=1)
    same[1:] = change == 0.0
    if not same.any():
        return same
    first = np.flatnonzero(~same)
    run = np.cumsum(~same) - 1
    jump = np.abs(np.diff(flat[first], axis=0)).max(axis=1)
    around = np.maximum(np.r_[0.0, jump], np.r_[jump, 0.0])
    return same & (around[run] > 2.5 * quantum)
