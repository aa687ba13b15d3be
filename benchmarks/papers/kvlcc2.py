"""The 7 m model of the tanker KVLCC2 by MMG: Yasukawa and Yoshimura 2015, tables 2-4 and eq. 4-27.

Runs in a second what the experiments of Xie et al. 2020 start from. Speeds at midships; SI units, radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from identify.estimators.estimate import FloatArray

SPEED = 1.179  # m/s, service speed at this scale
REVOLUTIONS = 12.042141  # 1/s, which hold it on a straight course by the equations below
RUDDER_RATE = np.radians(15.8)  # rad/s
STEP = 0.1  # s


@dataclass(frozen=True)
class Run:
    """A free run: time and states at every sample, (l,) each."""

    t: FloatArray
    u: FloatArray
    v: FloatArray
    r: FloatArray
    psi: FloatArray
    delta: FloatArray

    @property
    def states(self) -> FloatArray:
        """Columns u, v, r: (l, 3)."""
        return np.column_stack([self.u, self.v, self.r])


@njit(cache=True)
def accelerations(u, v, r, delta, n):  # noqa: ANN001, ANN201
    """Accelerations of surge, sway (midships) and yaw."""
    rho, length, draught, x_g = 1000.0, 7.0, 0.46, 0.25
    speed = np.sqrt(u * u + v * v) + 1e-9
    vp, rp, beta = v / speed, r * length / speed, np.arctan2(-v, u)
    force = 0.5 * rho * length * draught * speed**2
    x_hull = force * (-0.022 - 0.040 * vp**2 + 0.002 * vp * rp + 0.011 * rp**2 + 0.771 * vp**4)
    y_hull = force * (
        -0.315 * vp + 0.083 * rp - 1.607 * vp**3 + 0.379 * vp**2 * rp - 0.391 * vp * rp**2 + 0.008 * rp**3
    )
    n_hull = (
        force
        * length
        * (-0.137 * vp - 0.049 * rp - 0.030 * vp**3 - 0.294 * vp**2 * rp + 0.055 * vp * rp**2 - 0.013 * rp**3)
    )
    beta_p = beta + 0.48 * rp
    growth = 1 + (1 - np.exp(-2.0 * abs(beta_p))) * ((1.6 if beta_p > 0 else 1.1) - 1)
    wake = 1 - (1 - 0.35) * growth
    diameter = 0.216
    advance = u * (1 - wake) / (n * diameter) + 1e-9
    k_t = 0.2931 - 0.2753 * advance - 0.1385 * advance**2
    x_propeller = (1 - 0.220) * rho * n**2 * diameter**4 * k_t
    beta_r = beta + 0.710 * rp
    v_rudder = speed * (0.640 if beta_r > 0 else 0.395) * beta_r
    eta = 0.626
    race = 1 + 0.50 * (np.sqrt(1 + 8 * k_t / (np.pi * advance**2)) - 1)
    u_rudder = 1.09 * u * (1 - wake) * np.sqrt(eta * race**2 + 1 - eta)
    alpha = delta - np.arctan2(v_rudder, u_rudder)
    normal = 0.5 * rho * 0.0539 * (u_rudder**2 + v_rudder**2) * 2.747 * np.sin(alpha)
    x = x_hull + x_propeller - (1 - 0.387) * normal * np.sin(delta)
    y = y_hull - (1 + 0.312) * normal * np.cos(delta)
    moment = n_hull + (0.5 + 0.312 * 0.464) * length * normal * np.cos(delta)
    mass = rho * 3.27
    unit = 0.5 * rho * length**2 * draught
    m_x, m_y, j_z = 0.022 * unit, 0.223 * unit, 0.011 * unit * length**2
    inertia = mass * (0.25 * length) ** 2 + x_g**2 * mass + j_z
    a, b, c = mass + m_y, x_g * mass, inertia
    y -= (mass + m_x) * u * r
    moment -= x_g * mass * u * r
    determinant = a * c - b * b
    du = (x + (mass + m_y) * v * r + x_g * mass * r * r) / (mass + m_x)
    return du, (c * y - b * moment) / determinant, (a * moment - b * y) / determinant


@njit(cache=True)
def _zigzag(angle, switch, count, step, within, rate, n, speed):  # noqa: ANN001, ANN202
    rows = np.zeros((count, 5))
    u, v, r, psi, delta, order = speed, 0.0, 0.0, 0.0, 0.0, angle
    h = step / within
    for k in range(count):
        rows[k] = (u, v, r, psi, delta)
        if order > 0 and psi > switch:
            order = -angle
        elif order < 0 and psi < -switch:
            order = angle
        for _ in range(within):
            target = min(max(order, delta - rate * h), delta + rate * h)
            middle = 0.5 * (delta + target)
            a1, b1, c1 = accelerations(u, v, r, delta, n)
            a2, b2, c2 = accelerations(u + h / 2 * a1, v + h / 2 * b1, r + h / 2 * c1, middle, n)
            a3, b3, c3 = accelerations(u + h / 2 * a2, v + h / 2 * b2, r + h / 2 * c2, middle, n)
            a4, b4, c4 = accelerations(u + h * a3, v + h * b3, r + h * c3, target, n)
            psi += h * (r + h / 6 * (c1 + c2 + c3))
            u += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            v += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
            r += h / 6 * (c1 + 2 * c2 + 2 * c3 + c4)
            delta = target
    return rows


def zigzag(angle_deg: float, duration: float = 200.0) -> Run:
    """Zigzag angle/angle from a steady straight run."""
    count = round(duration / STEP) + 1
    angle = np.radians(angle_deg)
    rows = _zigzag(angle, angle, count, STEP, 10, RUDDER_RATE, REVOLUTIONS, SPEED)
    return Run(np.arange(count) * STEP, *rows.T)
