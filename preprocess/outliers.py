"""The robust 3σ principle as published, and its sliding form for signals with a trend, at uneven times."""

from __future__ import annotations

import numpy as np
from numba import njit

from preprocess.trial import BoolArray, FloatArray

#: Makes the median absolute deviation of Gaussian data their standard deviation.
MAD_TO_SIGMA = 1.4826
#: Width of the window of the local fit, samples on each side.
HALF_WINDOW = 6
#: Share of a signal's own variation below which no residual means anything (of a signal without noise).
NEGLIGIBLE = 1e-6


def robust_three_sigma(x: FloatArray, k: float = 3.0) -> BoolArray:
    """Mark outliers by the robust 3σ principle (Zhu et al. 2019, eqs. 5-7).

    Parameters
    ----------
    x : (n,)
        Values without a trend; on a manoeuvring vessel the rule discards genuine extremes.
    k : float
        Multiple of the robust standard deviation.

    Returns
    -------
    (n,) bool
        True for an outlier: ``|x - median| >= k · 1.4826 · MAD``.
    """
    centre = np.median(x)
    error = np.abs(x - centre)
    scale = MAD_TO_SIGMA * np.median(error)
    return np.asarray((error >= k * scale) & (error > 0.0))


@njit(cache=True)
def _solve(a, b, c):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Coefficients of the weighted quadratic with moments ``a`` (5,), right side ``b`` (3,)."""
    ridge = 1e-9 * (a[0] + a[4])
    m00, m01, m02, m11, m12, m22 = a[0] + ridge, a[1], a[2], a[2] + ridge, a[3], a[4] + ridge
    c00, c01, c02 = m11 * m22 - m12 * m12, m02 * m12 - m01 * m22, m01 * m12 - m02 * m11
    c11, c12, c22 = m00 * m22 - m02 * m02, m01 * m02 - m00 * m12, m00 * m11 - m01 * m01
    det = m00 * c00 + m01 * c01 + m02 * c02
    c[0] = (c00 * b[0] + c01 * b[1] + c02 * b[2]) / det
    c[1] = (c01 * b[0] + c11 * b[1] + c12 * b[2]) / det
    c[2] = (c02 * b[0] + c12 * b[1] + c22 * b[2]) / det


@njit(cache=True)
def _weighted(z, y, w, a, b):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for k in range(5):
        a[k] = 0.0
    for k in range(3):
        b[k] = 0.0
    for j in range(len(z)):
        power = w[j]
        for k in range(5):
            a[k] += power
            if k < 3:
                b[k] += power * y[j]
            power *= z[j]


@njit(cache=True)
def _median(values, scratch):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Median of a handful of values by insertion, which compiles at once; ``scratch`` is as long or longer."""
    n = len(values)
    for j in range(n):
        value, k = values[j], j
        while k > 0 and scratch[k - 1] > value:
            scratch[k] = scratch[k - 1]
            k -= 1
        scratch[k] = value
    return 0.5 * (scratch[(n - 1) // 2] + scratch[n // 2])


@njit(cache=True)
def _local_fit(t, x, half, rounds, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Residual of each sample from a robust local quadratic through its neighbours (itself left out)."""
    n = len(t)
    a, b, c3 = np.zeros(5), np.zeros(3), np.zeros(3)
    scratch = np.empty(2 * half)
    for i in range(n):
        low, high = max(0, i - half), min(n, i + half + 1)
        size = high - low - 1
        z, y, w = np.empty(size), np.empty(size), np.empty(size)
        fit, away = np.empty(size), np.empty(size)
        c, scale_t = 0, 1e-9
        for j in range(low, high):
            if j != i:
                z[c], y[c], w[c] = t[j] - t[i], x[j], 1.0
                scale_t = max(scale_t, abs(z[c]))
                c += 1
        centre = _median(y, scratch)
        for j in range(size):
            z[j] /= scale_t
            y[j] -= centre
        for round_ in range(rounds):
            _weighted(z, y, w, a, b)
            _solve(a, b, c3)
            for j in range(size):
                fit[j] = y[j] - c3[0] - c3[1] * z[j] - c3[2] * z[j] * z[j]
                away[j] = abs(fit[j])
            s = 1.4826 * _median(away, scratch) + 1e-12
            for j in range(size):
                q = fit[j] / (4.0 * s)
                if round_ == 0:
                    w[j] = 1.0 / max(abs(fit[j]) / s, 0.5)
                else:
                    w[j] = (1.0 - q * q) ** 2 if abs(q) < 1.0 else 1e-6
        out[i] = x[i] - centre - c3[0]


def local_residual(t: FloatArray, x: FloatArray, half: int = HALF_WINDOW, rounds: int = 4) -> FloatArray:
    """Residual of each sample from a robust quadratic through its neighbours in time.

    Parameters
    ----------
    t : (n,) s
        Strictly increasing, spaced as they come.
    x : (n,)
    half : int
        Neighbours on each side.
    rounds : int
        Reweightings (first towards the least absolute residual, then by Tukey's biweight).

    Returns
    -------
    (n,)
        NaN-free; zero where there are fewer than six samples.
    """
    out = np.zeros(len(t))
    if len(t) >= 6:
        _local_fit(np.ascontiguousarray(t, float), np.ascontiguousarray(x, float), half, rounds, out)
    return out


def sliding_three_sigma(
    t: FloatArray, x: FloatArray, k: float = 3.0, half: int = HALF_WINDOW, rounds: int = 4
) -> BoolArray:
    """Mark outliers by the robust 3σ principle on the residual from a robust local fit.

    Parameters
    ----------
    t : (n,) s
    x : (n,) or (n, m)
        A signal with a trend; an outlier in one component condemns the sample.
    k : float
    half, rounds : int
        As in :func:`local_residual`.

    Notes
    -----
    The scale is the larger of that of the whole signal and that of the sample's surroundings, so that a hard
    manoeuvre, which a quadratic follows less well, is not taken for a row of outliers.
    """
    flags = np.zeros(len(t), dtype=bool)
    if not len(t):
        return flags
    for column in np.reshape(x, (len(t), -1)).T:
        residual = local_residual(t, column, half, rounds)
        least = NEGLIGIBLE * float(np.std(column))
        flags |= np.abs(residual) > k * np.maximum(spread(residual), least)
    return flags


def spread(residual: FloatArray, width: int = 25) -> FloatArray:
    """Robust standard deviation of residuals: of the whole, and of the surroundings where larger; (n,)."""
    from scipy.ndimage import median_filter

    size = np.abs(residual)
    whole = MAD_TO_SIGMA * float(np.median(size)) if len(size) else 0.0
    local = MAD_TO_SIGMA * median_filter(size, size=width, mode="mirror") if len(size) >= width else whole
    return np.maximum(np.maximum(whole, local), 1e-12)
