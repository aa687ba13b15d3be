"""Noise levels by maximum likelihood of the innovations: process intensity and sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from preprocess.intensity import fitted_intensity
from preprocess.kalman import IntArray, Rows, cost
from preprocess.trial import FloatArray

#: Rows that the likelihood is evaluated on at most, in blocks spread over the log.
MOST_ROWS = 12_000
BLOCKS = 8
#: Rows for a first look, whose levels are estimated again.
FEW_ROWS = 4_000
#: A search begins at the intensity of the first guess, and at that which belongs to its noises where they are this
#: far apart, as a logarithm: either may lie beside the wrong one of two valleys.
APART = 2.0
#: Cost of a level beyond its bounds, per square of the logarithm.
STEEP = 100.0


@dataclass(frozen=True)
class Levels:
    """Noise levels of one chain.

    Attributes
    ----------
    q : float
        Intensity of the white third derivative, unit²/s⁵.
    sigma : (g,)
        Standard deviation of each group of rows (one per sensor), in the sensor's unit.
    evaluations : int
        Of the likelihood.
    """

    q: float
    sigma: FloatArray
    evaluations: int = 0


def thin_out(rows: Rows, group: IntArray, most: int = MOST_ROWS) -> tuple[Rows, IntArray]:
    """At most ``most`` rows, as unbroken blocks spread evenly."""
    n = len(rows.t)
    if n <= most:
        return rows, group
    size = most // BLOCKS
    starts = np.linspace(0, n - size, BLOCKS).astype(int)
    pick = (starts[:, None] + np.arange(size)).ravel()
    fresh = rows.fresh[pick].copy()
    fresh[::size] = True
    return Rows(
        rows.t[pick], rows.order[pick], rows.value[pick], rows.variance[pick], fresh, rows.scale[pick]
    ), group[pick]


def estimate_levels(
    rows: Rows,
    group: IntArray,
    start: Levels,
    prior: FloatArray,
    known: FloatArray,
    least: FloatArray,
    near: bool = False,
    most: FloatArray | None = None,
    rows_at_most: int = MOST_ROWS,
) -> Levels:
    """Maximum-likelihood noise levels of a chain.

    Parameters
    ----------
    rows : Rows
        Their ``variance`` is a weight (1 for a full sample) that multiplies the group's variance.
    group : (n,) int64
        Which sensor a row belongs to; -1 where nothing was measured.
    start : Levels
        First guess.
    prior : (3,)
        Variances at the start of a stretch.
    known : (g,)
        Standard deviations that are given; NaN where they are to be estimated.
    least : (g,)
        Standard deviations below which the estimates may not go.
    near : bool
        The first guess is an estimate already: the search begins in small steps.
    most : (g,), optional
        Standard deviations above which the estimates may not go.
    rows_at_most : int
        Rows that the likelihood is evaluated on at most.
    """
    from scipy.optimize import minimize

    thin, which = thin_out(rows, group, rows_at_most)
    free = np.flatnonzero(~np.isfinite(known))
    upper = np.full(len(known), np.inf) if most is None else np.maximum(most, least)
    count = 0

    def levels_of(x: FloatArray) -> tuple[float, FloatArray]:
        sigma = np.where(np.isfinite(known), known, 0.0)
        sigma[free] = np.clip(np.exp(np.clip(x[1:], -34.0, 34.0)), least[free], upper[free])
        return float(np.exp(np.clip(x[0], -80.0, 60.0))), sigma

    def rows_at(sigma: FloatArray) -> Rows:
        return replace(thin, variance=np.append(sigma, 1.0)[which] ** 2 * thin.variance)

    def objective(x: FloatArray) -> float:
        nonlocal count
        count += 1
        q, sigma = levels_of(x)
        beyond = x[1:] - np.log(
            sigma[free]
        )  # a slope back to the bounds, or a search ends on the level beyond
        return cost(rows_at(sigma), q, prior) + STEEP * float(beyond @ beyond)

    first = np.concatenate([[np.log(start.q)], np.log(start.sigma[free])])
    starts = [first]
    if not near:
        fitted = np.log(fitted_intensity(rows_at(levels_of(first)[1]), start.q, prior))
        if abs(fitted - first[0]) > APART:
            starts.append(np.r_[fitted, first[1:]])
    steps = (0.25 if near else 1.0) * np.r_[2.0, np.full(len(free), 0.5)]
    options = {"xatol": 1e-2, "fatol": 1e-2, "maxfev": 120 + 60 * len(free)}

    def descent(x: FloatArray) -> tuple[float, FloatArray]:
        simplex = np.vstack([x, x + np.diag(steps)])
        best = minimize(objective, x, method="Nelder-Mead", options={**options, "initial_simplex": simplex})  # type: ignore[call-overload]
        return float(best.fun), np.asarray(best.x, float)

    _, x = min((descent(x) for x in starts), key=lambda found: found[0])
    q, sigma = levels_of(x)
    return Levels(q, sigma, count)
