"""Any linear observer at uneven times, discretised exactly, its inputs straight in between."""

from __future__ import annotations

import numpy as np
from numba import njit

from preprocess.trial import FloatArray


@njit(cache=True)
def _product(a, b, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    n = a.shape[0]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += a[i, k] * b[k, j]
            out[i, j] = total


@njit(cache=True)
def _exponential(a):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Matrix exponential by scaling, a Taylor series of order 12, and squaring."""
    n = a.shape[0]
    size = 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(a[i, j])
        size = max(size, row)
    halvings = 0
    while size > 0.5:
        size *= 0.5
        halvings += 1
    scaled = a / 2.0**halvings
    out, term, work = np.eye(n), np.eye(n), np.zeros((n, n))
    for k in range(1, 13):
        _product(term, scaled, work)
        term = work / k
        out = out + term
    for _ in range(halvings):
        _product(out, out, work)
        out = work.copy()
    return out


@njit(cache=True)
def _run(t, w, a, b, start, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    n, k = a.shape[0], b.shape[1]
    big = np.zeros((n + 2 * k, n + 2 * k))
    x, last = start.copy(), -1.0
    e = np.zeros((n + 2 * k, n + 2 * k))
    out[0] = x
    for i in range(1, len(t)):
        h = t[i] - t[i - 1]
        if h != last:
            big[:n, :n] = a * h
            big[:n, n : n + k] = b * h
            for j in range(k):
                big[n + j, n + k + j] = 1.0
            e = _exponential(big)
            last = h
        old = x.copy()
        for p in range(n):
            total = 0.0
            for q in range(n):
                total += e[p, q] * old[q]
            for q in range(k):
                total += e[p, n + q] * w[i - 1, q] + e[p, n + k + q] * (w[i, q] - w[i - 1, q])
            x[p] = total
        out[i] = x


def run_linear(t: FloatArray, w: FloatArray, a: FloatArray, b: FloatArray, start: FloatArray) -> FloatArray:
    """Solve ``ẋ = a x + b w`` exactly at the samples, ``w`` running straight between them.

    Parameters
    ----------
    t : (n,) s
        Strictly increasing.
    w : (n, k)
    a : (m, m) 1/s
    b : (m, k)
    start : (m,)

    Returns
    -------
    (n, m)
    """
    out = np.empty((len(t), len(start)))
    arrays = (np.ascontiguousarray(x, dtype=float) for x in (t, w, a, b, start))
    _run(*arrays, out)
    return out
