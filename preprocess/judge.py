"""Which samples can be believed: receiver flags, repeated values, saturation; each with the reason kept."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from preprocess.raw import Raw
from preprocess.rounding import resolution
from preprocess.trial import BoolArray, FloatArray

#: Quantities whose sensors have a range that they can leave.
CLIPPED = ("yaw_rate", "velocity")
#: A sensor at the end of its range shows the same value so many times running, so many times in all, and so many
#: times more often than values within this share of its range beside it.
RUN, PILE, PILED, BESIDE = 3, 6, 3.0, 0.03
#: Values that repeat less than so many times as often as noise alone makes them were measured anew.
CHANCE = 1.25


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
    clips = raw.quantity in CLIPPED
    full = saturated(raw.value, quantum) & ~raw.flagged if clips else np.zeros(len(raw.t), dtype=bool)
    if raw.reach is not None:
        full |= ((raw.value < raw.reach[0]) | (raw.value > raw.reach[1])) & ~raw.flagged
    again = repeated(raw.value, quantum) & ~raw.flagged & ~full
    reasons = {"flagged": raw.flagged.sum(), "repeated": again.sum(), "saturated": full.sum()}
    good = ~(raw.flagged | again | full)
    return Judged(raw, good, {k: int(n) for k, n in reasons.items() if n}, quantum / np.sqrt(12.0))


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
    measured anew; one that stays because nothing moves was. Noise of a few steps meets the same value by chance as
    often as its neighbours: where values repeat no more often than that, all were measured.
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
    if flat.shape[1] == 1 and _by_chance(np.diff(flat[:, 0]), quantum):
        return np.zeros(n, dtype=bool)
    first = np.flatnonzero(~same)
    run = np.cumsum(~same) - 1
    jump = np.abs(np.diff(flat[first], axis=0)).max(axis=1)
    around = np.maximum(np.r_[0.0, jump], np.r_[jump, 0.0])
    return np.asarray(same & (around[run] > 2.5 * quantum), bool)


def _by_chance(change: FloatArray, quantum: float) -> bool:
    """Whether values repeat no more often than noise makes them, by how often they change by one step and by two.

    The changes that noise makes are normal: the logarithm of how often each comes falls with its square.
    """
    if not quantum > 0.0:
        return False
    steps = np.abs(np.rint(change / quantum))
    none, one, two = (int(np.sum(steps == k)) for k in range(3))
    if two == 0 or one < two:
        return False
    expected = 0.5 * one * (one / two) ** (1.0 / 3.0)
    return bool(none < CHANCE * expected + 3.0 * math.sqrt(expected))


def saturated(value: FloatArray, quantum: float) -> BoolArray:
    """Return samples at the end of a sensor's range, (n,) bool: the quantity went beyond, nobody knows how far.

    There the very same value comes many times running, far more often than those just short of it; at the natural
    extremes of a motion values near the greatest are as frequent as the greatest itself.
    """
    if len(value) < PILE:
        return np.zeros(len(value), dtype=bool)
    columns = value.reshape(len(value), -1).T
    return np.asarray(np.any([_at_end(c, quantum) | _at_end(-c, quantum) for c in columns], axis=0), bool)


def _at_end(x: FloatArray, quantum: float) -> BoolArray:
    """Which samples are clipped at the greatest value; (n,) bool."""
    end, span = float(x.max()), float(np.ptp(x))
    at = x == end
    edges = np.flatnonzero(np.diff(np.r_[False, at, False].astype(int)))
    longest = int(np.diff(edges)[::2].max(initial=0))
    near = int(((x < end) & (x > end - max(BESIDE * span, 5.5 * quantum))).sum())
    clipped = (
        end > 0.0
        and span > 0.0
        and longest >= RUN
        and at.sum() >= max(PILE, PILED * near)
        and at.mean() < 0.5
    )
    return at if clipped else np.zeros(len(x), dtype=bool)
