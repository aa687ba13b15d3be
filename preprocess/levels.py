"""Noise levels by maximum likelihood of the innovations: process intensity and sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from preprocess.descent import minimum
from preprocess.intensity import fitted_intensity
from preprocess.kalman import IntArray, Rows
from preprocess.likelihood import costs
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
    """

    q: float
    sigma: FloatArray


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
        The first guess is an estimate already: no second search begins elsewhere.
    most : (g,), optional
        Standard deviations above which the estimates may not go.
    rows_at_most : int
        Rows that the likelihood is evaluated on at most.
    """
    thin, which = thin_out(rows, group, rows_at_most)
    free = np.flatnonzero(~np.isfinite(known))
    upper = np.full(len(known), np.inf) if most is None else np.maximum(most, least)

    def levels_of(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        sigma = np.tile(np.where(np.isfinite(known), known, 0.0), (len(x), 1))
        sigma[:, free] = np.clip(np.exp(np.clip(x[:, 1:], -34.0, 34.0)), least[free], upper[free])
        return np.exp(np.clip(x[:, 0], -80.0, 60.0)), sigma

    def objective(x: FloatArray) -> FloatArray:
        q, sigma = levels_of(x)
        # a slope back to the bounds, or a search ends on the level beyond
        beyond = x[:, 1:] - np.log(sigma[:, free])
        factor = np.column_stack([sigma, np.ones(len(x))]).T[which] ** 2
        found = costs(thin, q, prior, factor * thin.variance[:, None])
        return np.asarray(found + STEEP * np.sum(beyond**2, axis=1), float)

    first = np.concatenate([[np.log(start.q)], np.log(start.sigma[free])])
    starts = [first]
    if not near:
        sigma = np.append(levels_of(first[None])[1][0], 1.0)[which]
        fitted = np.log(fitted_intensity(replace(thin, variance=sigma**2 * thin.variance), start.q, prior))
        if abs(fitted - first[0]) > APART:
            starts.append(np.r_[fitted, first[1:]])
    _, x = min((minimum(objective, x) for x in starts), key=lambda found: found[0])
    q, sigma = levels_of(x[None])
    if len(thin.t) < len(rows.t):
        q[0] = _of_all(rows, group, max(start.q, float(q[0])), sigma[0], prior)
    return Levels(float(q[0]), sigma[0])


def _of_all(rows: Rows, group: IntArray, q: float, sigma: FloatArray, prior: FloatArray) -> float:
    """Process intensity by all rows, looked for from ``q`` on: blocks may miss each of a few steps of the motion."""
    variance = np.append(sigma, 1.0)[group] ** 2 * rows.variance
    return fitted_intensity(replace(rows, variance=variance), q, prior)
