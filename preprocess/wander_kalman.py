"""The filter and smoother of ``preprocess.kalman`` with a fourth state: errors of the position that wander.

A satellite receiver's errors are white only in part; the rest changes slowly, as first-order Gauss-Markov noise
(Brown and Hwang 2012, sec. 5.3). It shows in the position and not in its rate. Discretised exactly; the smoother is
again that of Bryson and Frazier. Cost is linear in the number of rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from preprocess.kalman import Rows
from preprocess.trial import FloatArray
from preprocess.wiener import add_noise


@dataclass(frozen=True)
class Wander:
    """First-order Gauss-Markov noise: standard deviation (per component) and time constant, s."""

    sigma: float
    time: float


@njit(cache=True)
def _advance(m, p, f, dt, q, keep, gust, work):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Predict over an interval: chain by its Taylor series, wander by its decay."""
    b = 0.5 * dt * dt
    f[0, 1], f[0, 2], f[1, 2], f[3, 3] = dt, b, dt, keep
    for k in range(m.shape[1]):
        m[0, k] += dt * m[1, k] + b * m[2, k]
        m[1, k] += dt * m[2, k]
        m[3, k] *= keep
    _sandwich(f, p, work)
    add_noise(p, q, dt)
    p[3, 3] += gust


@njit(cache=True)
def _sandwich(f, p, work):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """F P F' in place."""
    for i in range(4):
        for j in range(4):
            work[i, j] = f[i, 0] * p[0, j] + f[i, 1] * p[1, j] + f[i, 2] * p[2, j] + f[i, 3] * p[3, j]
    for i in range(4):
        for j in range(4):
            p[i, j] = (
                work[i, 0] * f[j, 0] + work[i, 1] * f[j, 1] + work[i, 2] * f[j, 2] + work[i, 3] * f[j, 3]
            )


@njit(cache=True)
def _begin(m, p, value, variance, prior, wander):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for j in range(4):
        for k in range(m.shape[1]):
            m[j, k] = 0.0
        for k in range(4):
            p[j, k] = 0.0
    for k in range(m.shape[1]):
        m[0, k] = value[k]
    p[0, 0] = min(prior[0], 1e4 * (variance + wander))
    p[1, 1], p[2, 2], p[3, 3] = prior[1], prior[2], wander


@njit(cache=True)
def _innovate(m, p, o, value, variance, gain, e):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Variance of an innovation; ``e`` gets it, ``gain`` the gain. A position sees the wander too."""
    s = p[o, o] + variance
    for j in range(4):
        gain[j] = p[j, o]
    for k in range(m.shape[1]):
        e[k] = value[k] - m[o, k]
    if o == 0:
        s += 2.0 * p[0, 3] + p[3, 3]
        for j in range(4):
            gain[j] += p[j, 3]
        for k in range(m.shape[1]):
            e[k] -= m[3, k]
    for j in range(4):
        gain[j] /= s
    return s


@njit(cache=True)
def _take(m, p, gain, e, s):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for i in range(4):
        for k in range(m.shape[1]):
            m[i, k] += gain[i] * e[k]
        for j in range(4):
            p[i, j] -= gain[i] * gain[j] * s


@njit(cache=True)
def _filter(t, order, value, variance, fresh, scale, q, prior, wander, time, means, covariances):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return -2 log likelihood; predicted states are kept where there is room for them."""
    n = value.shape[1]
    m, p, f, work = np.zeros((4, n)), np.zeros((4, 4)), np.eye(4), np.zeros((4, 4))
    gain, e, total = np.zeros(4), np.zeros(n), 0.0
    for i in range(len(t)):
        if fresh[i]:
            first = i
            while first < len(t) - 1 and order[first] != 0:
                first += 1
            _begin(m, p, value[first], variance[first], prior, wander)
        else:
            dt = t[i] - t[i - 1]
            keep = np.exp(-dt / time)
            _advance(m, p, f, dt, q * scale[i], keep, wander * (1.0 - keep * keep), work)
        if len(means):
            for j in range(4):
                for k in range(n):
                    means[i, j, k] = m[j, k]
                for k in range(4):
                    covariances[i, j, k] = p[j, k]
        if order[i] >= 0:
            s = _innovate(m, p, order[i], value[i], variance[i], gain, e)
            total += n * np.log(s)
            for k in range(n):
                total += e[k] * e[k] / s
            _take(m, p, gain, e, s)
    return total


@njit(cache=True)
def _absorb(a, big, o, gain, e, s, c):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Take one measurement into the adjoint ``a`` and its variance ``big``."""
    quadratic = 0.0
    for i in range(4):
        c[i] = 0.0
        for j in range(4):
            c[i] += big[i, j] * gain[j]
        quadratic += gain[i] * c[i]
    seen = 2 if o == 0 else 1
    for k in range(a.shape[1]):
        u = e[k] / s
        for j in range(4):
            u += gain[j] * a[j, k]
        a[o, k] -= u
        if seen == 2:
            a[3, k] -= u
    for x in range(seen):
        h = o if x == 0 else 3
        for j in range(4):
            big[h, j] -= c[j]
            big[j, h] -= c[j]
        for y in range(seen):
            big[h, o if y == 0 else 3] += quadratic + 1.0 / s


@njit(cache=True)
def _correct(m, p, a, big, work, c):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Smoothed mean and covariance from the predicted ones, in place: m - P a, P - P Λ P."""
    for k in range(m.shape[1]):
        for i in range(4):
            for j in range(4):
                m[i, k] -= p[i, j] * a[j, k]
    for i in range(4):
        for j in range(4):
            work[i, j] = p[i, 0] * big[0, j] + p[i, 1] * big[1, j] + p[i, 2] * big[2, j] + p[i, 3] * big[3, j]
    for i in range(4):
        for j in range(4):
            c[i, j] = p[i, j]
            for k in range(4):
                c[i, j] -= work[i, k] * p[k, j]
    for i in range(4):
        for j in range(4):
            p[i, j] = c[i, j]


@njit(cache=True)
def _back(t, order, value, variance, fresh, time, means, covariances):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    n = value.shape[1]
    a, big, f, work = np.zeros((4, n)), np.zeros((4, 4)), np.eye(4), np.zeros((4, 4))
    gain, e, c, other = np.zeros(4), np.zeros(n), np.zeros(4), np.zeros((4, 4))
    for i in range(len(t) - 1, -1, -1):
        if order[i] >= 0:
            s = _innovate(means[i], covariances[i], order[i], value[i], variance[i], gain, e)
            _absorb(a, big, order[i], gain, e, s, c)
        _correct(means[i], covariances[i], a, big, work, other)
        if fresh[i]:
            for j in range(4):
                for k in range(n):
                    a[j, k] = 0.0
                for k in range(4):
                    big[j, k] = 0.0
            continue
        dt = t[i] - t[i - 1]
        b = 0.5 * dt * dt
        keep = np.exp(-dt / time)
        for k in range(n):
            a[2, k] += b * a[0, k] + dt * a[1, k]
            a[1, k] += dt * a[0, k]
            a[3, k] *= keep
        f[1, 0], f[2, 0], f[2, 1], f[3, 3] = dt, b, dt, keep  # the transpose of what predicts
        _sandwich(f, big, work)


def wander_cost(rows: Rows, q: float, prior: FloatArray, wander: Wander) -> float:
    """Return −2 log likelihood of the innovations, less its constant; see ``preprocess.kalman.cost``."""
    r = rows
    none = np.empty((0, 4, r.value.shape[1])), np.empty((0, 4, 4))
    return float(
        _filter(
            r.t, r.order, r.value, r.variance, r.fresh, r.scale, q, prior, wander.sigma**2, wander.time, *none
        )
    )


def smooth_with_wander(
    rows: Rows, q: float, prior: FloatArray, wander: Wander
) -> tuple[FloatArray, FloatArray]:
    """Smooth a chain whose positions wander; see ``preprocess.kalman.cost`` for the arguments.

    Returns
    -------
    mean, covariance : (n, 4, m), (n, 4, 4)
        Of position, rate, acceleration and wander at each row.
    """
    r = rows
    means, covariances = np.empty((len(r.t), 4, r.value.shape[1])), np.empty((len(r.t), 4, 4))
    _filter(
        r.t, r.order, r.value, r.variance, r.fresh, r.scale, q, prior, wander.sigma**2, wander.time,
        means, covariances,
    )  # fmt: skip
    _back(r.t, r.order, r.value, r.variance, r.fresh, wander.time, means, covariances)
    return means, covariances
