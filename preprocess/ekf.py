"""An extended Kalman filter for position, heading and body velocities: the papers' comparator.

State (x, y, ψ, u, v, r, u̇, v̇, ṙ): the kinematics turn the body velocities into the earth frame, the
accelerations wander (white third derivatives in the body frame). It filters forwards only, as in Zhu et
al. (2022); the default smoother uses later samples too and has no linearisation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from preprocess.trial import FloatArray


@dataclass(frozen=True)
class Tuning:
    """Process intensities of surge, sway (m²/s⁵) and yaw (rad²/s⁵); the sensors' noise (SI)."""

    surge: float
    sway: float
    yaw: float
    position: float
    heading: float
    yaw_rate: float = 0.0


@njit(cache=True)
def _transition(x, dt, f):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Move the state on by ``dt`` (second order) and set its Jacobian (first order)."""
    c, s = np.cos(x[2] + 0.5 * dt * x[5]), np.sin(x[2] + 0.5 * dt * x[5])
    u, v = x[3] + 0.5 * dt * x[6], x[4] + 0.5 * dt * x[7]
    f[0, 2], f[1, 2] = dt * (-u * s - v * c), dt * (u * c - v * s)
    f[0, 3], f[0, 4], f[1, 3], f[1, 4] = dt * c, -dt * s, dt * s, dt * c
    f[2, 5], f[3, 6], f[4, 7], f[5, 8] = dt, dt, dt, dt
    f[2, 8] = 0.5 * dt * dt
    x[0] += dt * (u * c - v * s)
    x[1] += dt * (u * s + v * c)
    x[2] += dt * x[5] + 0.5 * dt * dt * x[8]
    for k in range(3):
        x[3 + k] += dt * x[6 + k]


@njit(cache=True)
def _step(x, p, dt, q, f, work):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    _transition(x, dt, f)
    for i in range(9):
        for j in range(9):
            work[i, j] = 0.0
            for k in range(9):
                work[i, j] += f[i, k] * p[k, j]
    for i in range(9):
        for j in range(9):
            p[i, j] = 0.0
            for k in range(9):
                p[i, j] += work[i, k] * f[j, k]
    for k in range(3):
        p[3 + k, 3 + k] += q[k] * dt * dt * dt / 3.0
        p[3 + k, 6 + k] += q[k] * dt * dt / 2.0
        p[6 + k, 3 + k] += q[k] * dt * dt / 2.0
        p[6 + k, 6 + k] += q[k] * dt


@njit(cache=True)
def _take(x, p, k, value, variance, gain, row):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    s, e = p[k, k] + variance, value - x[k]
    for i in range(9):
        gain[i], row[i] = p[i, k] / s, p[k, i]
    for i in range(9):
        x[i] += gain[i] * e
        for j in range(9):
            p[i, j] -= gain[i] * row[j]


@njit(cache=True)
def _filter(t, which, value, variance, q, x, p, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    f, work, gain, row = np.eye(9), np.zeros((9, 9)), np.zeros(9), np.zeros(9)
    for i in range(len(t)):
        if i > 0 and t[i] > t[i - 1]:
            _step(x, p, t[i] - t[i - 1], q, f, work)
        _take(x, p, which[i], value[i], variance[i], gain, row)
        for j in range(9):
            out[i, j] = x[j]


def filter_motion(
    position: tuple[FloatArray, FloatArray],
    heading: tuple[FloatArray, FloatArray],
    yaw_rate: tuple[FloatArray, FloatArray] | None,
    tuning: Tuning,
) -> tuple[FloatArray, FloatArray]:
    """Filter the samples in the order of time.

    Parameters
    ----------
    position : (t (n,), value (n, 2) m)
    heading : (t (k,), value (k,) rad), unwrapped
    yaw_rate : (t, value rad/s), optional
    tuning : Tuning

    Returns
    -------
    t : (m,) s
        Distinct sensor times.
    state : (m, 9)
        x, y, ψ, u, v, r, u̇, v̇, ṙ after the samples of that time.
    """
    parts = [
        (position[0], position[1][:, 0], 0, tuning.position),
        (position[0], position[1][:, 1], 1, tuning.position),
    ]
    parts.append((heading[0], heading[1], 2, tuning.heading))
    if yaw_rate is not None:
        parts.append((yaw_rate[0], yaw_rate[1], 5, tuning.yaw_rate))
    t = np.concatenate([p[0] for p in parts])
    order = np.argsort(t, kind="stable")
    which = np.concatenate([np.full(len(p[0]), p[2]) for p in parts])[order]
    value = np.concatenate([p[1] for p in parts])[order]
    variance = np.concatenate([np.full(len(p[0]), p[3] ** 2) for p in parts])[order]
    start = np.zeros(9)
    start[:3] = position[1][0, 0], position[1][0, 1], heading[1][0]
    spread = np.diag(
        [tuning.position**2, tuning.position**2, tuning.heading**2, 100.0, 100.0, 1.0, 1.0, 1.0, 1.0]
    )
    out = np.empty((len(t), 9))
    intensities = np.array([tuning.surge, tuning.sway, tuning.yaw])
    _filter(t[order], which, value, variance, intensities, start, spread, out)
    last = np.append(np.diff(t[order]) > 0.0, True)
    return t[order][last], out[last]
