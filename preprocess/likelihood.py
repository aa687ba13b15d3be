"""The likelihood of a chain's innovations for several noise levels at once.

A search for noise levels asks for the same rows over and over. Eight sets of levels abreast, each in a lane of the
processor's registers, cost twice what one costs.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from preprocess.kalman import Rows, restart
from preprocess.trial import FloatArray

#: Sets of levels that are evaluated abreast.
LANES = 8
_COMPILED = {"cache": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}


@njit(**_COMPILED)
def _predict(p, m, dt, q):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """``preprocess.wiener.predict`` in every lane: ``p`` (6, lanes) is the covariance's upper triangle."""
    b, d2, d3 = 0.5 * dt * dt, dt * dt, dt * dt * dt
    n0, n1, n2, n3, n4 = d3 * d2 / 20.0, d2 * d2 / 8.0, d3 / 6.0, d3 / 3.0, d2 / 2.0
    for k in range(LANES):
        p01, p02, p11, p12, p22 = p[1, k], p[2, k], p[3, k], p[4, k], p[5, k]
        w01, w02 = p01 + dt * p11 + b * p12, p02 + dt * p12 + b * p22
        w12 = p12 + dt * p22
        p[0, k] += dt * p01 + b * p02 + dt * w01 + b * w02 + q[k] * n0
        p[1, k] = w01 + dt * w02 + q[k] * n1
        p[2, k] = w02 + q[k] * n2
        p[3, k] = p11 + dt * p12 + dt * w12 + q[k] * n3
        p[4, k] = w12 + q[k] * n4
        p[5, k] = p22 + q[k] * dt
    for c in range(m.shape[0]):
        for k in range(LANES):
            m[c, 0, k] += dt * m[c, 1, k] + b * m[c, 2, k]
            m[c, 1, k] += dt * m[c, 2, k]


@njit(**_COMPILED)
def _update(p, m, o, value, variance, gain, s, squares):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """``preprocess.wiener.update`` in every lane; ``squares`` gains the innovations' over their variance ``s``."""
    first, second, third = (0, 1, 2) if o == 0 else ((1, 3, 4) if o == 1 else (2, 4, 5))
    mine = first if o == 0 else (second if o == 1 else third)
    for k in range(LANES):
        s[k] = p[mine, k] + variance[k]
        gain[0, k], gain[1, k], gain[2, k] = p[first, k] / s[k], p[second, k] / s[k], p[third, k] / s[k]
    for c in range(m.shape[0]):
        for k in range(LANES):
            e = value[c] - m[c, o, k]
            squares[k] += e * e / s[k]
            m[c, 0, k] += gain[0, k] * e
            m[c, 1, k] += gain[1, k] * e
            m[c, 2, k] += gain[2, k] * e
    for k in range(LANES):
        g0, g1, g2 = gain[0, k], gain[1, k], gain[2, k]
        p[0, k] -= g0 * g0 * s[k]
        p[1, k] -= g0 * g1 * s[k]
        p[2, k] -= g0 * g2 * s[k]
        p[3, k] -= g1 * g1 * s[k]
        p[4, k] -= g1 * g2 * s[k]
        p[5, k] -= g2 * g2 * s[k]


@njit(**_COMPILED)
def _begin(p, m, i, t, order, value, variance, prior):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Every lane at the begin of a stretch."""
    mean, covariance = np.zeros((3, m.shape[0])), np.zeros((3, 3))
    for k in range(LANES):
        restart(mean, covariance, i, t, order, value, variance[:, k], prior)
        for j in range(3):
            p[j, k] = covariance[0, j]
            for c in range(m.shape[0]):
                m[c, j, k] = mean[j, c]
        p[3, k], p[4, k], p[5, k] = covariance[1, 1], covariance[1, 2], covariance[2, 2]


@njit(**_COMPILED)
def _costs(t, order, value, variance, fresh, scale, q, prior):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    p, m = np.zeros((6, LANES)), np.zeros((value.shape[1], 3, LANES))
    gain, s, level = np.zeros((3, LANES)), np.ones(LANES), np.zeros(LANES)
    squares, logs, product = np.zeros(LANES), np.zeros(LANES), np.ones(LANES)
    for i in range(len(t)):
        if fresh[i]:
            _begin(p, m, i, t, order, value, variance, prior)
        else:
            for k in range(LANES):
                level[k] = q[k] * scale[i, k]
            _predict(p, m, t[i] - t[i - 1], level)
        if order[i] < 0:
            continue
        _update(p, m, order[i], value[i], variance[i], gain, s, squares)
        far = False
        for k in range(LANES):
            product[k] *= s[k]
            far |= not 1e-150 < product[k] < 1e150
        if far:
            for k in range(LANES):
                logs[k] += np.log(product[k])
                product[k] = 1.0
    return squares + value.shape[1] * (logs + np.log(product))


def costs(
    rows: Rows,
    q: FloatArray,
    prior: FloatArray,
    variance: FloatArray | None = None,
    scale: FloatArray | None = None,
) -> FloatArray:
    """−2 log likelihoods (k,) of the innovations, less their constant, as ``preprocess.kalman.cost`` gives one.

    Parameters
    ----------
    rows : Rows
    q : (k,)
        Intensities of the white third derivative, unit²/s⁵.
    prior : (3,)
        Variances of position, rate and acceleration at the start of a stretch, at most.
    variance, scale : (n, k), optional
        In the place of the rows' own.
    """
    variance = rows.variance[:, None] if variance is None else variance
    scale = rows.scale[:, None] if scale is None else scale
    out = np.empty(len(q))
    for begin in range(0, len(q), LANES):
        some = np.minimum(np.arange(begin, begin + LANES), len(q) - 1)
        found = _costs(
            rows.t, rows.order, rows.value, _of(variance, some), rows.fresh, _of(scale, some), q[some], prior
        )
        out[begin : begin + LANES] = found[: len(q) - begin]
    return out


def _of(columns: FloatArray, some: FloatArray) -> FloatArray:
    """Some of the columns, or as often the only one, row by row in memory."""
    chosen = columns[:, some] if columns.shape[1] > 1 else np.repeat(columns, len(some), axis=1)
    return np.ascontiguousarray(chosen)
