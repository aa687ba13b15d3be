"""The polynomial model of Xie et al. 2020, eq. 5-6, with U(t), and its free run, a population at a time."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from identify.estimators.estimate import FloatArray

SIZES = (11, 16, 16)  # terms of surge, sway and yaw; each equation has a bias after them
DIVERGED = 1e3


def regressors(
    states: FloatArray, delta: FloatArray, u0: float, *, fixed: bool = False
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Designs of surge (l, 11), sway (l, 16) and yaw (l, 16).

    Eq. 6 prints ten terms of surge where its size and table 4 say eleven (r δ U is the missing one), and the
    first of yaw must be r. With ``fixed`` U is held at u0, as the ratios in table 4 show that the paper did.
    """
    u, v, r = states.T
    du, speed, d = u - u0, np.full(len(u), u0) if fixed else np.hypot(u, v), delta
    surge = [du, du * speed, du**2, du**3 / speed, v**2, r**2, d**2 * speed**2, d**2 * du * speed, v * r]
    surge += [v * d * speed, r * d * speed]
    shared = [speed**2, du * speed, du**2, v * speed, r * speed, d * speed**2, v**3 / speed, d**3 * speed**2]
    shared += [v**2 * r / speed, v**2 * d, v * d**2 * speed, d * du * speed, v * du, r * du, d * du**2]
    return np.column_stack(surge), np.column_stack([v, *shared]), np.column_stack([r, *shared])


@njit(cache=True)
def _derivative(theta, u, v, r, d, u0, fixed):  # noqa: ANN001, ANN202
    du, s = u - u0, u0 if fixed else np.sqrt(u * u + v * v) + 1e-12
    surge = (
        theta[0] * du + theta[1] * du * s + theta[2] * du * du + theta[3] * du**3 / s + theta[4] * v * v
        + theta[5] * r * r + theta[6] * d * d * s * s + theta[7] * d * d * du * s + theta[8] * v * r
        + theta[9] * v * d * s + theta[10] * r * d * s + theta[11]
    )  # fmt: skip
    both = np.zeros(2)
    for e in range(2):
        o = 12 + 17 * e
        both[e] = (
            theta[o] * (v if e == 0 else r) + theta[o + 1] * s * s + theta[o + 2] * du * s
            + theta[o + 3] * du * du + theta[o + 4] * v * s + theta[o + 5] * r * s + theta[o + 6] * d * s * s
            + theta[o + 7] * v**3 / s + theta[o + 8] * d**3 * s * s + theta[o + 9] * v * v * r / s
            + theta[o + 10] * v * v * d + theta[o + 11] * v * d * d * s + theta[o + 12] * d * du * s
            + theta[o + 13] * v * du + theta[o + 14] * r * du + theta[o + 15] * d * du * du + theta[o + 16]
        )  # fmt: skip
    return surge, both[0], both[1]


@njit(cache=True, parallel=True)
def free_runs(thetas, start, t, delta, u0, fixed):  # noqa: ANN001, ANN201
    """States (m, l, 3) of each parameter vector (m, 46) by Runge-Kutta; NaN from where one diverges."""
    m, l = thetas.shape[0], delta.shape[0]  # noqa: E741
    out = np.full((m, l, 3), np.nan)
    for k in prange(m):
        p = thetas[k]
        u, v, r = start[0], start[1], start[2]
        for i in range(l):
            out[k, i, 0], out[k, i, 1], out[k, i, 2] = u, v, r
            if i == l - 1:
                break
            d0, d1 = delta[i], delta[i + 1]
            dm, h = 0.5 * (d0 + d1), t[i + 1] - t[i]
            a1, b1, c1 = _derivative(p, u, v, r, d0, u0, fixed)
            a2, b2, c2 = _derivative(p, u + h / 2 * a1, v + h / 2 * b1, r + h / 2 * c1, dm, u0, fixed)
            a3, b3, c3 = _derivative(p, u + h / 2 * a2, v + h / 2 * b2, r + h / 2 * c2, dm, u0, fixed)
            a4, b4, c4 = _derivative(p, u + h * a3, v + h * b3, r + h * c3, d1, u0, fixed)
            u += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            v += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
            r += h / 6 * (c1 + 2 * c2 + 2 * c3 + c4)
            if not abs(u) + abs(v) + abs(r) < DIVERGED:
                break
    return out


def errors(
    thetas: FloatArray,
    t: FloatArray,
    states: FloatArray,
    delta: FloatArray,
    u0: float,
    *,
    fixed: bool = False,
) -> FloatArray:
    """Mean squared errors of u, v and r of each parameter vector's free run, (m, 3)."""
    runs = free_runs(np.atleast_2d(thetas), states[0], t, delta, u0, fixed)
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(np.mean((runs - states) ** 2, axis=1))
