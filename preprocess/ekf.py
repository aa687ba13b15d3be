"""An extended Kalman filter for position, heading and body velocities: the papers' comparator.

State (x, y, ψ, u, v, r, u̇, v̇, ṙ): the kinematics turn the body velocities into the earth frame, the
accelerations wander (white third derivatives in the body frame). It filters forwards only, as in Zhu et
al. (2022); the default smoother uses later samples too and has no linearisation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from preprocess.trial import FloatArray

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


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
def _sight(x, which, row):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """What a sensor shows of the state, and its sensitivities: a state, or the velocity north (9) or east (10)."""
    row[:] = 0.0
    if which < 9:
        row[which] = 1.0
        return x[which]
    c, s = np.cos(x[2]), np.sin(x[2])
    if which == 9:
        row[2], row[3], row[4] = -x[3] * s - x[4] * c, c, -s
        return x[3] * c - x[4] * s
    row[2], row[3], row[4] = x[3] * c - x[4] * s, s, c
    return x[3] * s + x[4] * c


@njit(cache=True)
def _take(x, p, which, value, variance, gain, row):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Take a sample; -2 log likelihood of its innovation is returned."""
    e = value - _sight(x, which, row)
    s = variance
    for i in range(9):
        gain[i] = 0.0
        for j in range(9):
            gain[i] += p[i, j] * row[j]
        s += row[i] * gain[i]
    for i in range(9):
        x[i] += gain[i] / s * e
        for j in range(9):
            p[i, j] -= gain[i] * gain[j] / s
    return e * e / s + np.log(s)


@njit(cache=True)
def _filter(t, which, value, variance, q, x, p, out, spread):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    f, work, gain, row = np.eye(9), np.zeros((9, 9)), np.zeros(9), np.zeros(9)
    total = 0.0
    for i in range(len(t)):
        if i > 0 and t[i] > t[i - 1]:
            _step(x, p, t[i] - t[i - 1], q, f, work)
        total += _take(x, p, which[i], value[i], variance[i], gain, row)
        for j in range(9):
            out[i, j] = x[j]
            spread[i, j] = p[j, j]
    return total


@dataclass(frozen=True)
class Sights:
    """Samples in the order of time: which state (0…8), or velocity north (9) or east (10); (n,) each."""

    t: FloatArray
    which: IntArray
    value: FloatArray
    variance: FloatArray


def in_order(parts: Sequence[tuple[FloatArray, FloatArray, int, float]]) -> Sights:
    """Samples of several sensors, each (t, value, which, standard deviation), in one order."""
    t = np.concatenate([p[0] for p in parts])
    order = np.argsort(t, kind="stable")
    which = np.concatenate([np.full(len(p[0]), p[2], dtype=np.int64) for p in parts])[order]
    variance = np.concatenate([np.full(len(p[0]), p[3] ** 2) for p in parts])[order]
    return Sights(t[order], which, np.concatenate([p[1] for p in parts])[order], variance)


def run_filter(
    sights: Sights, intensities: FloatArray, start: FloatArray, spread: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """State and its variances (n, 9) after each sample, and -2 log likelihood of all.

    Parameters
    ----------
    sights : Sights
    intensities : (3,)
        Of surge, sway and yaw.
    start, spread : (9,)
        State at the first sample and its standard deviations.
    """
    out, variances = np.empty((len(sights.t), 9)), np.empty((len(sights.t), 9))
    s = sights
    total = _filter(
        s.t, s.which, s.value, s.variance, intensities, start.copy(), np.diag(spread**2), out, variances
    )
    return out, variances, float(total)


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
    parts = [(position[0], position[1][:, k], k, tuning.position) for k in range(2)]
    parts.append((heading[0], heading[1], 2, tuning.heading))
    if yaw_rate is not None:
        parts.append((yaw_rate[0], yaw_rate[1], 5, tuning.yaw_rate))
    sights = in_order(parts)
    start = np.zeros(9)
    start[:3] = position[1][0, 0], position[1][0, 1], heading[1][0]
    spread = np.array([tuning.position, tuning.position, tuning.heading, 10.0, 10.0, 1.0, 1.0, 1.0, 1.0])
    out, _, _ = run_filter(sights, np.array([tuning.surge, tuning.sway, tuning.yaw]), start, spread)
    last = np.append(np.diff(sights.t) > 0.0, True)
    return sights.t[last], out[last]
