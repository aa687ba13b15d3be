"""Force of thrusters that turn, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identify.angles import cosine_and_sine
from identify.simd import COMPILED, WIDTH, load, store

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def turned(force: FloatArray, angle: FloatArray, place: tuple[float, float]) -> FloatArray:
    """Force along x, along y and moment about z (3, n) of a ``force`` (n,) at an ``angle`` (n,), rad, from a place."""
    out = np.empty((3, len(force)))
    _turn(np.ascontiguousarray(force), np.ascontiguousarray(angle), float(place[0]), float(place[1]), out)
    return out


@njit(**COMPILED)
def _turn(force, angle, x, y, out):
    n = force.shape[0]
    whole = n - n % WIDTH
    for i in range(0, whole, WIDTH):
        cosine, sine = cosine_and_sine(load(angle, i))
        along, across = load(force, i) * cosine, load(force, i) * sine
        store(out, i, along)
        store(out, n + i, across)
        store(out, 2 * n + i, across * x - along * y)
    for i in range(whole, n):
        out[0, i], out[1, i] = force[i] * math.cos(angle[i]), force[i] * math.sin(angle[i])
        out[2, i] = x * out[1, i] - y * out[0, i]
