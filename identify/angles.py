"""Cosine and sine of eight angles abreast."""

from __future__ import annotations

from numba import njit

from identify.simd import INLINED, nearest, splat


@njit(**INLINED)
def cosine_and_sine(angle):
    """Cosine and sine of eight angles, to a few units in the last place up to thousands of turns."""
    k = nearest(angle * 0.15915494309189535)
    # a quarter of the angle less whole turns, in three parts of 2π; then twice the double angle
    x = angle - k * 6.28318530717958623199592693709
    x = (x - k * 2.44929359829470635445213186455e-16) * 0.25
    z = x * x
    s = z * (1.0 / 355687428096000.0) + splat(-1.0 / 1307674368000.0)
    s = z * s + splat(1.0 / 6227020800.0)
    s = z * s + splat(-1.0 / 39916800.0)
    s = z * s + splat(1.0 / 362880.0)
    s = z * s + splat(-1.0 / 5040.0)
    s = z * s + splat(1.0 / 120.0)
    s = z * s + splat(-1.0 / 6.0)
    s = x + x * (z * s)
    c = z * (1.0 / 20922789888000.0) + splat(-1.0 / 87178291200.0)
    c = z * c + splat(1.0 / 479001600.0)
    c = z * c + splat(-1.0 / 3628800.0)
    c = z * c + splat(1.0 / 40320.0)
    c = z * c + splat(-1.0 / 720.0)
    c = z * c + splat(1.0 / 24.0)
    c = z * c + splat(-0.5)
    c = z * c + splat(1.0)
    s, c = 2.0 * (s * c), (c - s) * (c + s)
    return (c - s) * (c + s), 2.0 * (s * c)
