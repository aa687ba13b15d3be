"""The flow behind the hull, compiled: wake, thrust, race and rudder, each with its derivatives.

Yasukawa and Yoshimura 2015: wake and thrust eqs. 12-18, rudder eqs. 19-27. ``x_y`` is the derivative of ``x`` by ``y``:
by u, v, r (of the hull), n (revolutions), and the parameters of ``identify.flow``: w (w_P0), c (C_2), k (kappa).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identify.flow import COLUMNS, PLACES, ROOM
from identify.simd import COMPILED

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
PlaceArray = np.ndarray[tuple[int, ...], np.dtype[np.uint64]]
#: A drift angle and its derivatives by u and v; a rate of turn and its derivatives by u, v and r.
Vector = tuple[float, float, float]
Quad = tuple[float, float, float, float]

#: A part is written out where it is called: it rounds as the whole does.
WRITTEN_OUT = COMPILED | {"inline": "always"}


@njit(**COMPILED)  # type: ignore[untyped-decorator]
def flow(q: FloatArray, place: PlaceArray, constants: FloatArray, at: int) -> None:
    """Put thrust, F_N sin δ and F_N cos δ, all per mass, and their derivatives in ``q`` from place ``at`` on.

    Each takes ``COLUMNS`` places: its value, then its derivatives by u, v, r, and the channels.

    Parameters
    ----------
    q : (values,)
        Values of the tape: u, v, r at 1, 2, 3.
    place : (10,)
        Where in it the channels of ``identify.flow.CHANNELS`` are.
    constants : (11,)
        As ``identify.flow.constants_of`` gives them.
    """
    length, c1, x_p, thrust, d = constants[0], constants[1], constants[2], constants[3], constants[4]
    k0, k1, k2, eta, rudder, sign = (
        constants[5], constants[6], constants[7], constants[8], constants[9], constants[10],
    )  # fmt: skip
    u, v, r = q[1], q[2], q[3]
    delta, n, w0 = sign * q[place[0]], q[place[1]], q[place[2]]
    epsilon, kappa, l_r = q[place[5]], q[place[6]], q[place[9]]
    speed = max(math.sqrt(u * u + v * v), 1e-3)
    # drift angle and rate of turn without dimension
    drift, turn = (math.atan2(-v, u), v / (speed * speed), -u / (speed * speed)), r * length / speed
    turning = (turn, -turn * u / (speed * speed), -turn * v / (speed * speed), length / speed)
    port = drift[0] - x_p * turn > 0
    advance, by_state, advance_w, advance_c = _wake(
        u, drift, turning, x_p, c1, w0, q[place[3]] if port else q[place[4]]
    )
    q[at + 0], by_advance, by_n = _thrust(advance, n, thrust, d, k0, k1, k2)
    along, along_a, along_n, along_k = _race(advance, n, d, k0, k1, k2, kappa, eta)
    positive = drift[0] - l_r * turn > 0
    gamma = q[place[7]] if positive else q[place[8]]
    across, across_by, across_g = _across(u, v, speed, drift, turning, l_r, gamma)
    normal, by_along, by_across, by_delta = _normal(epsilon * along, across, delta, rudder)
    e = epsilon * by_along
    for k in range(3):
        q[at + 1 + k] = by_advance * by_state[k]
        q[at + COLUMNS + 1 + k] = e * along_a * by_state[k] + by_across * across_by[k]
    q[at + 4], q[at + COLUMNS + 4] = 0.0, by_delta
    q[at + 5], q[at + COLUMNS + 5] = by_n, e * along_n
    q[at + 6], q[at + COLUMNS + 6] = by_advance * advance_w, e * along_a * advance_w
    for k in range(2):
        own = advance_c if (k == 0) == port else 0.0
        q[at + 7 + k], q[at + COLUMNS + 7 + k] = by_advance * own, e * along_a * own
        own = across_g if (k == 0) == positive else 0.0
        q[at + 11 + k], q[at + COLUMNS + 11 + k] = 0.0, by_across * own
    q[at + 9], q[at + COLUMNS + 9] = 0.0, by_along * along
    q[at + 10], q[at + COLUMNS + 10] = 0.0, e * along_k
    q[at + 13], q[at + COLUMNS + 13] = 0.0, -by_across * speed * gamma * turn
    _split(q, at, normal, delta, sign)


@njit(**WRITTEN_OUT)  # type: ignore[untyped-decorator]
def _wake(
    u: float, drift: Vector, turning: Quad, x_p: float, c1: float, w0: float, c2: float
) -> tuple[float, Vector, float, float]:
    """Speed of advance u (1 - w_P), eqs. 12-18, and its derivatives: by u, v, r; by w_P0; by C_2 of this side."""
    inflow = drift[0] - x_p * turning[0]
    decay = math.exp(-c1 * abs(inflow))
    growth = 1.0 + (1.0 - decay) * (c2 - 1.0)
    by_inflow = (1.0 - w0) * (c2 - 1.0) * c1 * decay * (1.0 if inflow > 0 else -1.0)
    share = (1.0 - w0) * growth
    by_state = (
        share + u * by_inflow * (drift[1] - x_p * turning[1]),
        u * by_inflow * (drift[2] - x_p * turning[2]),
        -u * by_inflow * x_p * turning[3],
    )
    return u * share, by_state, -u * growth, u * (1.0 - w0) * (1.0 - decay)


@njit(**WRITTEN_OUT)  # type: ignore[untyped-decorator]
def _thrust(a: float, n: float, thrust: float, d: float, k0: float, k1: float, k2: float) -> Vector:
    """Thrust per mass at a speed of advance ``a``, of K_T = k0 + k1 J + k2 J², and its derivatives by a and n."""
    by_a = thrust * (k1 * abs(n) / d + 2.0 * k2 * abs(a) / (d * d))
    by_n = thrust * (2.0 * k0 * abs(n) + k1 * math.copysign(1.0, n) * a / d)
    return thrust * (k0 * n * abs(n) + k1 * abs(n) * a / d + k2 * a * abs(a) / (d * d)), by_a, by_n


@njit(**WRITTEN_OUT)  # type: ignore[untyped-decorator]
def _race(a: float, n: float, d: float, k0: float, k1: float, k2: float, kappa: float, eta: float) -> Quad:
    """Speed at the rudder over ε, of which η is in the propeller's race, and its derivatives by a, n and κ."""
    loading = 8.0 / math.pi
    square = a * a + loading * (k0 * n * n * d * d + k1 * n * d * a + k2 * a * a)
    race = math.sqrt(max(square, 1e-8))
    race_a, race_n = 0.0, 0.0
    if square > 1e-8:
        race_a = (a + loading * (0.5 * k1 * n * d + k2 * a)) / race
        race_n = loading * (k0 * n * d * d + 0.5 * k1 * d * a) / race
    behind = a + kappa * (race - a)
    both = max(math.sqrt(eta * behind * behind + (1.0 - eta) * a * a), 1e-6)
    both_a = (eta * behind * (1.0 + kappa * (race_a - 1.0)) + (1.0 - eta) * a) / both
    return both, both_a, eta * behind * kappa * race_n / both, eta * behind * (race - a) / both


@njit(**WRITTEN_OUT)  # type: ignore[untyped-decorator]
def _across(
    u: float, v: float, speed: float, drift: Vector, turning: Quad, l_r: float, gamma: float
) -> tuple[float, Vector, float]:
    """Speed across the rudder, U γ_R β_R, and its derivatives: by u, v, r; by γ_R of this side."""
    inflow = drift[0] - l_r * turning[0]
    by_state = (
        gamma * (u / speed * inflow + speed * (drift[1] - l_r * turning[1])),
        gamma * (v / speed * inflow + speed * (drift[2] - l_r * turning[2])),
        -speed * gamma * l_r * turning[3],
    )
    return speed * gamma * inflow, by_state, speed * inflow


@njit(**WRITTEN_OUT)  # type: ignore[untyped-decorator]
def _normal(along: float, across: float, delta: float, rudder: float) -> Quad:
    """Normal force per mass, U_R² sin(δ - atan(v_R/u_R)) times ``rudder``; its derivatives by u_R, v_R and δ."""
    s, c = math.sin(delta), math.cos(delta)
    total = max(math.sqrt(along * along + across * across), 1e-6)
    lift, drag = along * s - across * c, along * c + across * s
    by_along = rudder * (along / total * lift + total * s)
    by_across = rudder * (across / total * lift - total * c)
    return rudder * total * lift, by_along, by_across, rudder * total * drag


@njit(**WRITTEN_OUT)  # type: ignore[untyped-decorator]
def _split(q: FloatArray, at: int, normal: float, delta: float, sign: float) -> None:
    """F_N sin δ and F_N cos δ with their derivatives, of those of F_N that stand in place of the first."""
    s, c = math.sin(delta), math.cos(delta)
    q[at + COLUMNS + 0], q[at + 2 * COLUMNS + 0] = normal * s, normal * c
    for k in range(1, COLUMNS):
        by = q[at + COLUMNS + k]
        q[at + COLUMNS + k], q[at + 2 * COLUMNS + k] = by * s, by * c
    q[at + COLUMNS + 4] = sign * (q[at + COLUMNS + 4] + normal * c)
    q[at + 2 * COLUMNS + 4] = sign * (q[at + 2 * COLUMNS + 4] - normal * s)


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def flow_along(states: FloatArray, channels: FloatArray, constants: FloatArray) -> FloatArray:
    """Thrust, F_N sin δ and F_N cos δ (n, 3) per mass, along states (n, 6) with channels (n, 10)."""
    q, place, out = (
        np.zeros(4 + PLACES + ROOM),
        np.arange(4, 4 + PLACES).astype(np.uint64),
        np.empty((len(states), 3)),
    )
    for i in range(len(states)):
        q[1], q[2], q[3] = states[i, 3], states[i, 4], states[i, 5]
        for k in range(PLACES):
            q[4 + k] = channels[i, k]
        flow(q, place, constants, 4 + PLACES)
        for k in range(3):
            out[i, k] = q[4 + PLACES + k * COLUMNS]
    return out
