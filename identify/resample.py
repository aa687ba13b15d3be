"""Logged inputs on an even grid, the straight line that stands for each step, and means over several, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def means_of_held(t, value, begin, dt, n):
    """Means (n,) over ``n`` steps of ``dt`` of values that hold from their time until the next, and for ever before.

    The second (n,) is the mean of v·|v| less the same of the mean: what a thrust has more where it switches in a step.
    """
    mean, more = np.empty(n), np.zeros(n)
    last = len(t) - 1
    j = k = 0
    while k < n:
        a = begin + k * dt
        while j < last and t[j + 1] <= a:
            j += 1
        whole = n if j == last else min(n, int((t[j + 1] - begin) / dt))
        for i in range(k, whole):
            mean[i] = value[j]
        k = max(k, whole)
        if k == n:
            break
        a, b = begin + k * dt, begin + (k + 1) * dt
        total, square = 0.0, 0.0
        while j < last and t[j + 1] < b:
            total += value[j] * (t[j + 1] - a)
            square += value[j] * abs(value[j]) * (t[j + 1] - a)
            a = t[j + 1]
            j += 1
        mean[k] = (total + value[j] * (b - a)) / dt
        more[k] = (square + value[j] * abs(value[j]) * (b - a)) / dt - mean[k] * abs(mean[k])
        k += 1
    return mean, more


@njit(cache=True, nogil=True, error_model="numpy")
def at_middles(t, value, begin, dt, n):
    """Values (n,) halfway through ``n`` steps of ``dt`` on straight lines between the samples, held beyond the ends."""
    last = len(t) - 1
    out = np.empty(n)
    j = 0
    for k in range(n):
        x = begin + (k + 0.5) * dt
        while j < last and t[j + 1] <= x:
            j += 1
        if x <= t[0] or j == last:
            out[k] = value[j]
        else:
            out[k] = value[j] + (value[j + 1] - value[j]) * ((x - t[j]) / (t[j + 1] - t[j]))
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def straight_lines(fine, parts):
    """Mean and slope (n, nc) of the line that has the mean and first moment of every ``parts`` values of ``fine``.

    ``fine`` (nc, n·parts); the slope is the line's end less its middle.
    """
    nc, n = fine.shape[0], fine.shape[1] // parts
    mean, slope = np.empty((n, nc)), np.empty((n, nc))
    middle, per = 0.5 * (parts - 1), 6.0 / (parts * parts)
    for c in range(nc):
        for i in range(n):
            total, moment = 0.0, 0.0
            for k in range(parts):
                value = fine[c, i * parts + k]
                total += value
                moment += (k - middle) * value
            mean[i, c] = total / parts
            slope[i, c] = moment * per
    return mean, slope


@njit(cache=True, nogil=True, error_model="numpy")
def rates(fine, dt):
    """Rates (nc, n) of what is given every ``dt``, by the neighbours' difference."""
    out = np.empty_like(fine)
    last = fine.shape[1] - 1
    for c in range(fine.shape[0]):
        for i in range(last + 1):
            before, after = max(i - 1, 0), min(i + 1, last)
            out[c, i] = (fine[c, after] - fine[c, before]) / ((after - before) * dt)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def averaged_at(columns, weights, every):
    """Weighted means (m, k) about every so manieth row of ``columns`` (n, k), nothing beyond the ends.

    ``weights`` (2 h + 1,) are those of the rows from ``h`` before to ``h`` after.
    """
    n, half = columns.shape[0], len(weights) // 2
    out = np.zeros(((n + every - 1) // every, columns.shape[1]))
    for i in range(out.shape[0]):
        first = i * every - half
        for j in range(max(0, -first), min(len(weights), n - first)):
            for k in range(columns.shape[1]):
                out[i, k] += weights[j] * columns[first + j, k]
    return out
