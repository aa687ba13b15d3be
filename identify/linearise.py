"""Derivatives of the accelerations at one stage of a step: by the state, and by what the parameters move.

The tape is gone through backwards, for all five equations abreast.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identify.flow import COLUMNS as BY_FLOW
from identify.kernel import FLOW, TINY
from identify.simd import INLINED, load, splat, store
from identify.tape import ROW


@njit(**INLINED)
def backwards(rows, steps, q, adjoint):
    """Derivatives of the accelerations with respect to every value of the tape, ``adjoint`` (values, 8)."""
    left, right, single, base = steps.left, steps.right, steps.single, steps.base
    n = left.shape[0]
    for k in range(base):
        store(adjoint, ROW * k, splat(0.0))
    for k in range(n):
        store(adjoint, ROW * (base + k), load(rows, ROW * k))
    for k in range(single.shape[0]):
        place = ROW * np.int64(single[k])
        store(adjoint, place, load(adjoint, place) + load(rows, ROW * (n + k)))
    for k in range(n - 1, -1, -1):
        a = load(adjoint, ROW * (base + k))
        one, other = ROW * np.int64(left[k]), ROW * np.int64(right[k])
        store(adjoint, one, load(adjoint, one) + a * q[right[k]])
        store(adjoint, other, load(adjoint, other) + a * q[left[k]])


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
    for k in range(along.column.shape[0]):
        force[stage, along.equation[k], along.column[k]] = along.weight[k] * q[along.value[k]]
    for k in range(along.general.shape[0]):
        for e in range(5):
            force[stage, e, along.general[k]] = 0.0
    for k in range(along.moved.shape[0]):
        force[stage, along.moved_equation[k], along.moved[k]] += (
            along.moved_weight[k] * q[along.moved_value[k]]
        )
    for k in range(along.driven_place.shape[0]):
        change = along.driven[row, k] + part * along.driven_slope[row, k]
        for e in range(5):
            force[stage, e, along.driven_column[k]] += adjoint[along.driven_place[k], e] * change
