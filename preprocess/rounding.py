"""To what step values were rounded."""

from __future__ import annotations

import numpy as np

from preprocess.trial import FloatArray
from preprocess.vessel import Input

#: Fewer levels than this may be whole multiples of a large step by chance, or by an operator's choice.
LEVELS = 8
#: Levels closer than this share of their span are one (numbers of single precision); steps are none below the second.
SAME, LEAST = 2e-5, 1e-4
#: The share to which a step is known; this many ratios must miss a whole number by chance, and at most this share do.
STEP_KNOWN, MISSES, FEW = 0.02, 10.0, 0.1
#: An input whose span is fewer steps than this goes where it was told in such steps; nothing was rounded.
COARSEST = 20.0


def resolution(value: FloatArray) -> float:
    """Return the step to which values were rounded, the largest of their columns'; 0 where none shows.

    Parameters
    ----------
    value : (n,) or (n, m)
    """
    if not len(value):
        return 0.0
    columns = np.reshape(value, (len(value), -1)).T
    return max((_step(c) for c in columns), default=0.0)


def _step(column: FloatArray) -> float:
    """Return the smallest change, if nearly all changes are whole multiples of it, and not all one."""
    every = np.abs(np.diff(column))
    change = every[every > 1e-12]
    if len(change) < 20:
        return 0.0
    smallest = float(np.percentile(change, 1.0))
    quantum = float(np.median(change[change < 1.5 * smallest]))
    ratio = change[change < 200.0 * quantum] / quantum
    varied = np.ptp(np.round(ratio)) >= 1.0 or len(change) < 0.98 * len(every)
    return quantum if varied and np.median(ratio) < 50.0 and _whole(ratio) else 0.0


def _whole(ratio: FloatArray) -> bool:
    """Return whether far fewer ratios miss a whole number than those of values that nothing rounded would.

    The step is known to a fiftieth: larger ratios tell less, and those above half of that nothing.
    """
    telling = ratio[ratio < 0.5 / STEP_KNOWN]
    within = STEP_KNOWN * np.maximum(telling, 1.0)
    missed = np.count_nonzero(np.abs(telling - np.round(telling)) >= within)
    by_chance = float(np.sum(1.0 - 2.0 * within))
    return bool(by_chance >= MISSES and missed < FEW * by_chance)


def input_step(declared: Input, value: FloatArray) -> float:
    """Return the step to which an input was rounded as it was logged, in its physical unit; 0 where none shows.

    An input that steps and holds shows no small changes: its step is what all its levels are whole multiples of.

    Parameters
    ----------
    declared : Input
        Where its calibration has several slopes, the step is the root mean square over the values.
    value : (n,)
        Physical values of all logs.
    """
    if not declared.pwm:
        return common_step(value)
    order = np.argsort(declared.value, kind="stable")
    pwm, physical = (np.asarray(x, dtype=float)[order] for x in (declared.pwm, declared.value))
    if (np.diff(physical) <= 0.0).any():  # a dead zone, or a fold: the raw value cannot be told
        return 0.0
    step = common_step(np.interp(value, physical, pwm))
    part = np.clip(np.searchsorted(physical, value) - 1, 0, len(pwm) - 2)
    return step * float(np.sqrt(np.mean((np.diff(physical) / np.diff(pwm))[part] ** 2)))


def common_step(value: FloatArray) -> float:
    """Return the largest step of which all differences of values (n,) are whole multiples; 0 where there is none.

    Euclid's algorithm on the differences of neighbouring levels; that of a few levels is no rounding.
    """
    levels = np.unique(value[np.isfinite(value)])
    span = float(np.ptp(levels)) if len(levels) else 0.0
    apart = np.diff(levels)
    apart = apart[apart > SAME * span]
    if len(apart) < LEVELS - 1:
        return 0.0
    step = float(apart.min())
    for difference in apart:
        step = _divisor(float(difference), step, SAME * span)
        if step < LEAST * span:
            return 0.0
    return step if span > COARSEST * step else 0.0


def _divisor(a: float, b: float, least: float) -> float:
    """Return the greatest common divisor of two numbers; remainders below ``least`` are none."""
    while b > least:
        a, b = b, abs(a - b * round(a / b))
    return a
