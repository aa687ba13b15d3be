"""Kalman filter and fixed-interval smoother of one chain (position, rate, acceleration) at uneven times.

The chain is an integrated Wiener process: its third derivative is white noise of intensity ``q``. Between
two rows it is discretised exactly (``preprocess.wiener``), so nothing is resampled and samples may be
missing. The smoother is that of Bryson and Frazier in the form of de Jong (1989), which needs no inverse and
gives the deletion residuals (de Jong and Penzer 1998) on the way. Cost is linear in the number of rows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from preprocess.trial import BoolArray, FloatArray
from preprocess.wiener import back, disturbance, predict, update

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Which rows are smoothed: all; those that measure nothing; none (deletion residuals and disturbances alone).
ALL, UNMEASURED, NONE = 0, 1, 2
#: Rows in which the first position and the first rate of a stretch are looked for.
LOOK_AHEAD = 1000


@dataclass(frozen=True)
class Rows:
    """Measurements of a chain in the order of time.

    Attributes
    ----------
    t : (n,) s
        Non-decreasing; several rows may share a time.
    order : (n,) int64
        0 position, 1 rate, 2 acceleration, -1 nothing measured (a time at which the state is wanted).
    value : (n, m)
        ``m`` components that share the covariance (north and east), SI.
    variance : (n,)
        Of each component.
    fresh : (n,) bool
        True where a new stretch begins: the state is forgotten.
    scale : (n,)
        Factor on the process intensity in the interval before the row: more where the vessel is driven
        harder.
    """

    t: FloatArray
    order: IntArray
    value: FloatArray
    variance: FloatArray
    fresh: BoolArray
    scale: FloatArray


@dataclass(frozen=True)
class Smoothed:
    """A smoothed chain.

    Attributes
    ----------
    mean, covariance : (n, 3, m), (n, 3, 3)
        At each row.
    deletion, deletion_variance : (n, m), (n,)
        Sample less the smoother without it, and the variance of that; NaN in blank rows.
    drive, drive_expected : (n,)
        Squared length of the smoothed disturbance in the interval before the row, in its own metric, and
        what it should be if the process intensity there is right.
    """

    mean: FloatArray
    covariance: FloatArray
    deletion: FloatArray
    deletion_variance: FloatArray
    drive: FloatArray
    drive_expected: FloatArray


@njit(cache=True)
def restart(m, p, i, t, order, value, variance, prior):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Begin a stretch at its first position and rate, sure of them to 100 standard deviations.

    A wider prior would be no more ignorant, but the smoother would subtract large numbers from large numbers.
    """
    for j in range(3):  # an assignment of whole rows would take seconds to compile
        for k in range(m.shape[1]):
            m[j, k] = 0.0
        for k in range(3):
            p[j, k] = prior[j] if j == k else 0.0
    seen = -1
    for j in range(i, min(len(order), i + LOOK_AHEAD)):
        o = order[j]
        if (o == 0 or o == 1) and o != seen:
            wait = t[j] - t[i]
            loose = 1e4 * variance[j] + prior[o + 1] * wait * wait
            if o == 0 or loose < prior[1]:
                p[o, o] = min(prior[o], loose)
                for k in range(m.shape[1]):
                    m[o, k] = value[j, k]
            if seen >= 0:
                break
            seen = o


@njit(cache=True)
def _cost(t, order, value, variance, fresh, scale, q, prior):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    m, p = np.zeros((3, value.shape[1])), np.zeros((3, 3))
    work, gain = np.zeros((3, 3)), np.zeros(3)
    squares, logs, product = 0.0, 0.0, 1.0
    for i in range(len(t)):
        if fresh[i]:
            restart(m, p, i, t, order, value, variance, prior)
        else:
            predict(m, p, t[i] - t[i - 1], q * scale[i], work)
        o = order[i]
        if o < 0:
            continue
        s = p[o, o] + variance[i]
        for k in range(value.shape[1]):
            e = value[i, k] - m[o, k]
            squares += e * e / s
        product *= s  # a logarithm takes as long as the rest of the row: one for several rows
        if not 1e-150 < product < 1e150:
            logs += np.log(product)
            product = 1.0
        update(m, p, o, value[i], variance[i], gain)
    return squares + value.shape[1] * (logs + np.log(product))


@njit(cache=True)
def _forward(t, order, value, variance, fresh, scale, q, prior, means, covariances):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    m, p = np.zeros((3, value.shape[1])), np.zeros((3, 3))
    work, gain = np.zeros((3, 3)), np.zeros(3)
    for i in range(len(t)):
        if fresh[i]:
            restart(m, p, i, t, order, value, variance, prior)
        else:
            predict(m, p, t[i] - t[i - 1], q * scale[i], work)
        for j in range(3):
            for k in range(m.shape[1]):
                means[i, j, k] = m[j, k]
            for k in range(3):
                covariances[i, j, k] = p[j, k]
        if order[i] >= 0:
            update(m, p, order[i], value[i], variance[i], gain)


@njit(cache=True)
def _absorb(o, p, value, m, variance, a, big, gain, c, u):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Take one measurement into the adjoint; ``u`` gets the smoothation error, its variance is returned."""
    s = p[o, o] + variance
    for j in range(3):
        gain[j] = p[j, o] / s
    for k in range(m.shape[1]):
        u[k] = (value[k] - m[o, k]) / s
        for j in range(3):
            u[k] += gain[j] * a[j, k]
        a[o, k] -= u[k]
    quadratic = 0.0
    for i in range(3):
        c[i] = 0.0
        for j in range(3):
            c[i] += big[i, j] * gain[j]
        quadratic += gain[i] * c[i]
    for j in range(3):
        big[o, j] -= c[j]
        big[j, o] -= c[j]
    big[o, o] += quadratic + 1.0 / s
    return quadratic + 1.0 / s


@njit(cache=True)
def _correct(m, p, a, big, work):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Smoothed mean and covariance from the predicted ones, in place: m - P a, P - P Λ P."""
    for k in range(m.shape[1]):
        for i in range(3):
            for j in range(3):
                m[i, k] -= p[i, j] * a[j, k]
    for i in range(3):
        for j in range(3):
            work[i, j] = p[i, 0] * big[0, j] + p[i, 1] * big[1, j] + p[i, 2] * big[2, j]
    p00, p01, p02, p11, p12, p22 = p[0, 0], p[0, 1], p[0, 2], p[1, 1], p[1, 2], p[2, 2]
    for i in range(3):
        w0, w1, w2 = work[i, 0], work[i, 1], work[i, 2]
        p[i, 0] -= w0 * p00 + w1 * p01 + w2 * p02
        p[i, 1] -= w0 * p01 + w1 * p11 + w2 * p12
        p[i, 2] -= w0 * p02 + w1 * p12 + w2 * p22


@njit(cache=True)
def _backward(t, order, value, variance, fresh, scale, q, correct, means, covariances, deletion, sizes):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    n, m = value.shape
    a, big, work = np.zeros((3, m)), np.zeros((3, 3)), np.zeros((3, 3))
    gain, c, u = np.zeros(3), np.zeros(3), np.zeros(m)
    for i in range(n - 1, -1, -1):
        if order[i] >= 0:
            d = _absorb(order[i], covariances[i], value[i], means[i], variance[i], a, big, gain, c, u)
            sizes[0, i] = 1.0 / d
            for k in range(m):
                deletion[i, k] = u[k] / d
        if correct == ALL or (correct == UNMEASURED and order[i] < 0):
            _correct(means[i], covariances[i], a, big, work)
        if fresh[i]:
            a[:] = 0.0
            big[:] = 0.0
        else:
            dt = t[i] - t[i - 1]
            sizes[1, i], sizes[2, i] = disturbance(a, big, dt, q * scale[i])
            back(a, big, dt, work)


def cost(rows: Rows, q: float, prior: FloatArray) -> float:
    """Return −2 log likelihood of the innovations, less its constant.

    Parameters
    ----------
    rows : Rows
    q : float
        Intensity of the white third derivative, unit²/s⁵.
    prior : (3,)
        Variances of position, rate and acceleration at the start of a stretch, at most.
    """
    r = rows
    return float(_cost(r.t, r.order, r.value, r.variance, r.fresh, r.scale, q, prior))


def misfit(rows: Rows, q: float, prior: FloatArray) -> float:
    """Return the sum of the squared standardised innovations; see :func:`cost` for the arguments."""
    return cost(rows, q, prior) - cost(replace(rows, value=np.zeros_like(rows.value)), q, prior)


def smooth(rows: Rows, q: float, prior: FloatArray, correct: int = ALL) -> Smoothed:
    """Smooth a chain given its noise levels; see :func:`cost` for the other arguments.

    Parameters
    ----------
    correct : int
        Which rows' mean and covariance are wanted (``ALL``, ``UNMEASURED``, ``NONE``); the others hold what was
        predicted from the rows before.
    """
    r = rows
    n, m = r.value.shape
    means, covariances = np.empty((n, 3, m)), np.empty((n, 3, 3))
    deletion, sizes = np.full((n, m), np.nan), np.zeros((3, n))
    sizes[0] = np.nan
    sensors = r.t, r.order, r.value, r.variance, r.fresh, r.scale
    _forward(*sensors, q, prior, means, covariances)
    _backward(*sensors, q, correct, means, covariances, deletion, sizes)
    return Smoothed(means, covariances, deletion, sizes[0], sizes[1], sizes[2])
