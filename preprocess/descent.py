"""The least of a smooth function of few unknowns that is evaluated at several points at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from preprocess.trial import FloatArray

#: Values (k,) at points (k, d).
Function = Callable[[FloatArray], FloatArray]
#: Distance over which slopes and curvatures are taken; longest step along any axis.
SPACING, LONGEST = 0.1, 3.0
#: What is added to the curvatures in the steps that are tried, and multiples of the one without.
DAMPINGS, BEYOND = (0.0, 0.3, 3.0, 30.0, 300.0, 3e3), (1.7, 3.0)
#: A gain that is no gain, a step that is no step, and steps at most.
LEAST_GAIN, LEAST_STEP, STEPS = 0.01, 0.01, 25


def minimum(function: Function, start: FloatArray) -> tuple[float, FloatArray]:
    """The least value found from ``start`` (d,), and where: Newton's steps, several dampings of each tried at once.

    The unknowns' natural unit is 1 (logarithms); the function's, a -2 log likelihood's.
    """
    x, value = np.asarray(start, float), np.inf
    for _ in range(STEPS):
        value, slope, curvature = _surface(function, x)
        steps = _newton(slope, curvature)
        if np.abs(steps[0]).max() < LEAST_STEP:
            break
        tried = x + steps
        found = np.nan_to_num(function(tried), nan=np.inf)
        best = int(np.argmin(found))
        if found[best] >= value:
            break
        gain, x, value = value - found[best], tried[best], float(found[best])
        if gain < LEAST_GAIN:
            break
    return float(value), x


def _surface(function: Function, x: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Value, slope (d,) and curvature (d, d) at ``x`` by differences."""
    d, e = len(x), SPACING * np.eye(len(x))
    pairs = [(i, j) for i in range(d) for j in range(i)]
    at = function(np.vstack([x, x + e, x - e, *(x + e[i] + e[j] for i, j in pairs)]))
    here, up, down = float(at[0]), at[1 : d + 1], at[d + 1 : 2 * d + 1]
    curvature = np.diag((up - 2.0 * here + down) / SPACING**2)
    for (i, j), both in zip(pairs, at[2 * d + 1 :], strict=True):
        curvature[i, j] = curvature[j, i] = (both - up[i] - up[j] + here) / SPACING**2
    return here, (up - down) / (2.0 * SPACING), curvature


def _newton(slope: FloatArray, curvature: FloatArray) -> FloatArray:
    """Newton's steps (k, d) downhill whatever the curvature's sign, the undamped one first."""
    if not (np.isfinite(slope).all() and np.isfinite(curvature).all()):
        return np.zeros((1, len(slope)))
    size, axes = np.linalg.eigh(curvature)
    firm = np.maximum(np.abs(size), 1e-9) + np.array(DAMPINGS)[:, None]
    along = np.clip(-(axes.T @ slope) / firm, -LONGEST, LONGEST)
    return np.asarray(np.vstack([along, *(b * along[0] for b in BEYOND)]) @ axes.T, float)
