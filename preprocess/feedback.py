"""Feedback of an actuator without its noise: straight lines with corners, as far from the samples as their noise is.

A rudder moves at its own rate, stops, and moves again. Noise on its feedback would hardly move a hull, but a linkage
with slack follows every extreme of it: the slack would seem wider by two standard deviations of the noise. Changes of
slope are few and large, so their absolute values count, not their squares (trend filtering: Kim, Koh, Boyd and
Gorinevsky 2009, by iteratively reweighted least squares).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from preprocess.trial import FloatArray

#: The weight of corners is sought between these, as powers of ten, in so many halvings of so many reweightings each.
RANGE, HALVINGS, REWEIGHTINGS = (-6.0, 6.0), 10, 8
#: Changes of slope below this share of the noise's own count as none; samples that come sooner one after the other than
#: this share of their usual interval, as that far apart.
NONE, SOON = 1e-3, 0.02


def without_noise(t: FloatArray, value: FloatArray, sigma: float) -> FloatArray:
    """Values (n,) at times ``t`` (n,), s, without white noise of this standard deviation.

    The fewest corners whose lines are on average as far from the samples as that.
    """
    if len(t) < 4 or not sigma > 0.0:
        return value
    low, high = RANGE
    found = value
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        lines = _lines(t, value, sigma, 10.0**middle)
        if float(np.mean((lines - value) ** 2)) > sigma**2:
            high = middle
        else:
            low, found = middle, lines
    return found


def _lines(t: FloatArray, value: FloatArray, sigma: float, weight: float) -> FloatArray:
    """Lines (n,) for a weight of corners against distance, in units of what noise makes of either."""
    steps = np.maximum(np.diff(t), SOON * np.median(np.diff(t)))
    before, after = 1.0 / steps[:-1], 1.0 / steps[1:]
    here, usual = -(before + after), sigma / float(np.median(steps))
    x, corner = value, np.full(len(t) - 2, weight / usual**2)
    for _ in range(REWEIGHTINGS):
        bands = np.zeros((3, len(t)))
        bands[2] = 1.0 / sigma**2
        bands[2, :-2] += corner * before**2
        bands[2, 1:-1] += corner * here**2
        bands[2, 2:] += corner * after**2
        bands[1, 1:-1] += corner * before * here
        bands[1, 2:] += corner * here * after
        bands[0, 2:] += corner * before * after
        x = np.asarray(solveh_banded(bands, value / sigma**2, check_finite=False), dtype=float)
        change = np.abs(before * x[:-2] + here * x[1:-1] + after * x[2:])
        corner = weight / usual / np.maximum(change, NONE * usual)
    return x
