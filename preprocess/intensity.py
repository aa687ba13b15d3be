"""The process intensity of the greatest likelihood, everything else given."""

from __future__ import annotations

import numpy as np

from preprocess.kalman import Rows, cost
from preprocess.trial import FloatArray

#: Half the bracket in which an intensity is looked for, as a logarithm, and how often it is moved on.
BRACKET, MOST_BRACKETS = 9.0, 5


def fitted_cost(rows: Rows, q: float, prior: FloatArray) -> float:
    """Least -2 log likelihood over the process intensity."""
    return cost(rows, fitted_intensity(rows, q, prior), prior)


def fitted_intensity(rows: Rows, q: float, prior: FloatArray) -> float:
    """Return the process intensity of the greatest likelihood, looked for from ``q`` up- and downwards."""
    for _ in range(MOST_BRACKETS):
        found = _golden_section(rows, q, prior)
        if abs(np.log(found / q)) < 0.9 * BRACKET:
            break
        q = found
    return found


def _golden_section(rows: Rows, q: float, prior: FloatArray) -> float:
    """Return the likeliest intensity within the bracket about ``q``."""
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    low, high = np.log(q) - BRACKET, np.log(q) + BRACKET
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    fa, fb = cost(rows, float(np.exp(a)), prior), cost(rows, float(np.exp(b)), prior)
    for _ in range(8):
        if fa < fb:
            high, b, fb = b, a, fa
            a = high - ratio * (high - low)
            fa = cost(rows, float(np.exp(a)), prior)
        else:
            low, a, fa = a, b, fb
            b = low + ratio * (high - low)
            fb = cost(rows, float(np.exp(b)), prior)
    return float(np.exp(a if fa < fb else b))
