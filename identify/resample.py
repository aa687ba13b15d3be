"""Logged inputs on an even grid, and the straight line that stands for each step, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def means_of_held(t, value, edges):
    """Mean (n,) between ``edges`` (n + 1,) of values that hold from their time until the next, and for ever before."""
    n, last = len(edges) - 1, len(t) - 1
    out = np.empty(n)
    j = 0
    for k in range(n):
        a, b = edges[k], edges[k + 1]
        while j < last and t[j + 1] <= a:
            j += 1
        if j == last or t[j + 1] >= b:
            out[k] = value[j]
            continue
        total, i, at = 0.0, j, a
        while i < last and t[i + 1] < b:
            total += value[i] * (t[i + 1] - at)
            at = t[i + 1]
            i += 1
        out[k] = (total + value[i] * (b - at)) / (b - a)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def at_middles(t, value, edges):
    """Values (n,) halfway between ``edges`` (n + 1,) on straight lines between the samples, held beyond the ends."""
    n, last = len(edges) - 1, len(t) - 1
    out = np.empty(n)
    j = 0
    for k in range(n):
        x = 0.5 * (edges[k] + edges[k + 1])
        while j < last and t[j + 1] <= x:
            j += 1
        if x <= t[0] or j == last:
            out[k] = value[j]
        else:
            out[k] = value[j] + (value[j + 1] - value[j]) * ((x - t[j]) / (t[j + 1] - t[j]))
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def straight_lines(fine, parts):
    """Mean and slope (n, nc) of the line that has the mean and the first moment of every ``parts`` rows of ``fine``.

    The slope is the line's end less its middle.
    """
    n, nc = fine.shape[0] // parts, fine.shape[1]
    mean, slope = np.empty((n, nc)), np.empty((n, nc))
    middle, per = 0.5 * (parts - 1), 6.0 / (parts * parts)
    for i in range(n):
        for c in range(nc):
            total, moment = 0.0, 0.0
            for k in range(parts):
                value = fine[i * parts + k, c]
                total += value
                moment += (k - middle) * value
            mean[i, c] = total / parts
            slope[i, c] = moment * per
    return mean, slope
