"""The process intensity of the greatest likelihood, everything else given."""

from __future__ import annotations

import numpy as np

from preprocess.kalman import Rows
from preprocess.likelihood import LANES, costs
from preprocess.trial import FloatArray

#: Half the bracket in which an intensity is looked for, as a logarithm, and how often it is moved on.
BRACKET, MOST_BRACKETS = 9.0, 5


def fitted_cost(rows: Rows, q: float, prior: FloatArray) -> float:
    """Least -2 log likelihood over the process intensity."""
    return likeliest(rows, q, prior)[0]


def fitted_intensity(rows: Rows, q: float, prior: FloatArray) -> float:
    """Return the process intensity of the greatest likelihood, looked for from ``q`` up- and downwards."""
    return likeliest(rows, q, prior)[1]


def likeliest(rows: Rows, q: float, prior: FloatArray) -> tuple[float, float]:
    """Least -2 log likelihood over the process intensity, and the intensity."""
    for _ in range(MOST_BRACKETS):
        about = _least_of(rows, np.log(q), BRACKET, prior)[1]
        if abs(about - np.log(q)) < 0.9 * BRACKET:
            break
        q = float(np.exp(about))
    value, level = _least_of(rows, about, 2.0 * BRACKET / (LANES - 1), prior)
    return value, float(np.exp(level))


def _least_of(rows: Rows, about: float, half: float, prior: FloatArray) -> tuple[float, float]:
    """Least cost and its log intensity on a grid about one, on the parabola through the least and its neighbours."""
    x = np.linspace(about - half, about + half, LANES)
    y = costs(rows, np.exp(x), prior)
    k = int(np.argmin(y))
    if not 0 < k < LANES - 1:
        return float(y[k]), float(x[k])
    slope, bend = 0.5 * (y[k + 1] - y[k - 1]), y[k + 1] - 2.0 * y[k] + y[k - 1]
    share = -slope / max(bend, 1e-300)
    return float(y[k] + 0.5 * slope * share), float(x[k] + share * (x[1] - x[0]))
