"""Derivatives of the accelerations at one stage of a step: by the state, and by what the parameters move.

The tape is gone through backwards, for all five equations abreast.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identify.flow import COLUMNS as BY_FLOW
from identify.kernel import FLOW, TINY
from identify.simd import INLINED, load, load_like, put, splat, splat_half, store, take
from identify.tape import ROW


@njit(**INLINED)
def backwards(rows, steps, q, adjoint):
    """Derivatives of the accelerations with respect to every value of the tape, ``adjoint`` (values, 8)."""
    if steps.needs[2]:
        _backwards(rows, steps, q, adjoint, splat(0.0))
    else:
        _backwards(rows, steps, q, adjoint, splat_half(0.0))


@njit(**INLINED)
def _backwards(rows, steps, q, adjoint, zero):
    """Derivatives of the first accelerations, as many as ``zero`` has places."""
    left, right, single, base = steps.left, steps.right, steps.single, steps.base
    n = left.shape[0]
    for k in range(base):
        store(adjoint, ROW * k, zero)
    for k in range(n):
        store(adjoint, ROW * (base + k), load_like(zero, rows, ROW * k))
    for k in range(single.shape[0]):
        place = ROW * np.int64(take(single, k))
        store(adjoint, place, load_like(zero, adjoint, place) + load_like(zero, rows, ROW * (n + k)))
    for k in range(n - 1, -1, -1):
        a = load_like(zero, adjoint, ROW * (base + k))
        first, second = take(left, k), take(right, k)
        one, other = ROW * np.int64(first), ROW * np.int64(second)
        store(adjoint, one, load_like(zero, adjoint, one) + a * take(q, second))
        store(adjoint, other, load_like(zero, adjoint, other) + a * take(q, first))


@njit(**INLINED)
def jacobian_of(steps, q, psi, north, east, adjoint, jacobian, place):
    """Put the derivatives with respect to u, v, r, e1, e2 and heading at flat ``place`` of ``jacobian``.

    What the rows of the relative wind hold becomes the derivatives with respect to the air's velocity.
    """
    u, v, r = q[1], q[2], q[3]
    by_u = load(adjoint, ROW) + load(adjoint, 4 * ROW) * np.sign(u) + load(adjoint, 8 * ROW)
    by_v = load(adjoint, 2 * ROW) + load(adjoint, 5 * ROW) * np.sign(v)
    by_r = load(adjoint, 3 * ROW) + load(adjoint, 6 * ROW) * np.sign(r)
    if steps.needs[0]:
        speed, inverse = max(q[7], 1e-9), -q[9] * q[9] if q[7] > TINY else 0.0
        by_speed = load(adjoint, 7 * ROW) + load(adjoint, 9 * ROW) * inverse
        by_u = by_u + by_speed * (u / speed)
        by_v = by_v + by_speed * (v / speed)
    if steps.needs[1]:
        c, s = math.cos(psi), math.sin(psi)
        wx, wy = north * c + east * s - u, -north * s + east * c - v
        air = math.sqrt(wx * wx + wy * wy)
        safe = max(air, 1e-9)
        xx, xy, yy = air + wx * wx / safe, wx * wy / safe, air + wy * wy / safe
        along, across = load(adjoint, 12 * ROW), load(adjoint, 13 * ROW)
        by_wx, by_wy = along * xx + across * xy, along * xy + across * yy
        by_u, by_v = by_u - by_wx, by_v - by_wy
        store(jacobian, place + 5 * ROW, by_wx * (wy + v) - by_wy * (wx + u))
        store(adjoint, 12 * ROW, by_wx * c - by_wy * s)
        store(adjoint, 13 * ROW, by_wx * s + by_wy * c)
    if steps.needs[3]:
        at = steps.base + steps.left.shape[0]
        for k in range(3):
            by, d = load(adjoint, (FLOW + k) * ROW), at + k * BY_FLOW + 1
            by_u, by_v, by_r = by_u + by * q[d], by_v + by * q[d + 1], by_r + by * q[d + 2]
            for c in range(steps.flow_place.shape[0]):
                to = ROW * np.int64(steps.flow_place[c])
                store(adjoint, to, load(adjoint, to) + by * q[d + 3 + c])
    if steps.needs[2]:
        store(jacobian, place + 3 * ROW, load(adjoint, 10 * ROW))
        store(jacobian, place + 4 * ROW, load(adjoint, 11 * ROW))
    store(jacobian, place, by_u)
    store(jacobian, place + ROW, by_v)
    store(jacobian, place + 2 * ROW, by_r)


@njit(**INLINED)
def forcing(along, row, part, q, adjoint, force, stage):
    """What the parameters add to the accelerations' tangents at one stage, ``force`` (4, FORCED, width)."""
    width = force.shape[2]
    begin = stage * force.shape[1] * width
    for k in range(along.column.shape[0]):
        place = begin + take(along.equation, k) * width + take(along.column, k)
        put(force, place, take(along.weight, k) * take(q, take(along.value, k)))
    for k in range(along.general.shape[0]):
        for e in range(5):
            put(force, begin + e * width + take(along.general, k), 0.0)
    for k in range(along.moved.shape[0]):
        place = begin + take(along.moved_equation, k) * width + take(along.moved, k)
        change = take(along.moved_weight, k) * take(q, take(along.moved_value, k))
        put(force, place, take(force, place) + change)
    many = along.driven.shape[1]
    for k in range(along.driven_place.shape[0]):
        at = row * many + k
        change = take(along.driven, at) + part * take(along.driven_slope, at)
        by, place = ROW * take(along.driven_place, k), begin + take(along.driven_column, k)
        for e in range(5):
            put(force, place + e * width, take(force, place + e * width) + take(adjoint, by + e) * change)
