"""The container ship of Son and Nomoto 1981 in four degrees of freedom (surge, sway, yaw, roll), 175 m.

Coefficients and equations as published there and in Fossen 1994, appendix E.1.3. SI units and radians outside, the
prime system inside. Positive rudder turns to starboard.
"""

from __future__ import annotations

import math

import numpy as np

from benchmarks.papers.record import Helm, Record
from identify.estimators.estimate import FloatArray

LENGTH, RHO, G = 175.0, 1025.0, 9.81
M, M_X, M_Y = 0.00792, 0.000238, 0.007049
I_X, J_X, I_Z, J_Z = 0.0000176, 0.0000034, 0.000456, 0.000419
L_X = L_Y = 0.0313
ALPHA_Y = 0.05
DISPLACED, RUDDER_AREA, ASPECT, DIAMETER, GM = 21222.0, 33.0376, 1.8219, 6.533, 0.3 / 175.0
DEDUCTION, WAKE, TAU, X_P = 0.175, 0.184, 1.09, -0.526
RUDDER_RATE = math.radians(5.0)


def accelerations(x: FloatArray, delta: float, n: float) -> FloatArray:
    """Rates of u, v, r, p, φ, ψ at rudder (rad) and revolutions per second."""
    speed = math.hypot(x[0], x[1])
    u, v, r, p = x[0] / speed, x[1] / speed, x[2] * LENGTH / speed, x[3] * LENGTH / speed
    phi = x[4]
    weight = RHO * G * DISPLACED / (0.5 * RHO * LENGTH**2 * speed**2)
    v_r = 0.088 * v - 0.156 * r - 0.275 * r**3 + 1.96 * r * r * v
    u_p = math.cos(v) * ((1 - WAKE) + TAU * (v + X_P * r) ** 2)
    advance = u_p * speed / (n * DIAMETER)
    k_t = 0.527 - 0.455 * advance
    u_r = u_p * 0.921 * math.sqrt(1 + 8 * 0.631 * k_t / (math.pi * advance**2))
    alpha = delta + math.atan(v_r / u_r)
    normal = (
        -(6.13 * ASPECT / (ASPECT + 2.25)) * (RUDDER_AREA / LENGTH**2) * (u_r**2 + v_r**2) * math.sin(alpha)
    )
    thrust = 2 * DIAMETER**4 / (speed**2 * LENGTH**2) * k_t * n * abs(n)
    a = -0.0004226 * u * u + (1 - DEDUCTION) * thrust - 0.00311 * v * r - 0.00386 * v * v + 0.00020 * r * r
    a += -0.00020 * phi * phi + 0.71 * normal * math.sin(delta) + (M + M_Y) * v * r
    b = -0.0116 * v + 0.00242 * r - 0.000063 * phi - 0.109 * v**3 + 0.00177 * r**3 + 0.0214 * v * v * r
    b += -0.0405 * v * r * r + 0.04605 * v * v * phi + 0.00304 * v * phi * phi + 0.009325 * r * r * phi
    b += -0.001368 * r * phi * phi + (1 + 0.237) * normal * math.cos(delta) - (M + M_X) * u * r
    c = 0.0003026 * v - 0.000063 * r - 0.0000075 * p - 0.000021 * phi + 0.002843 * v**3 - 0.0000462 * r**3
    c += -0.000588 * v * v * r + 0.0010565 * v * r * r - 0.0012012 * v * v * phi - 0.0000793 * v * phi * phi
    c += -0.000243 * r * r * phi + 0.00003569 * r * phi * phi - (1 + 0.237) * 0.033 * normal * math.cos(delta)
    c += M_X * L_X * u * r - weight * GM * phi
    d = -0.0038545 * v - 0.00222 * r + 0.000213 * p - 0.0001424 * phi + 0.001492 * v**3 - 0.00229 * r**3
    d += -0.0424 * v * v * r + 0.00156 * v * r * r - 0.019058 * v * v * phi - 0.0053766 * v * phi * phi
    d += -0.0038592 * r * r * phi + 0.0024195 * r * phi * phi
    d += (-0.5 - 0.237 * 0.48) * normal * math.cos(delta)
    m22, m32, m42, m33, m44 = M + M_Y, -M_Y * L_Y, M_Y * ALPHA_Y, I_X + J_X, I_Z + J_Z
    determinant = m22 * m33 * m44 - m32**2 * m44 - m42**2 * m33
    dv = (m33 * m44 * b - m32 * m44 * c - m42 * m33 * d) / determinant
    dr = (-m42 * m33 * b + m32 * m42 * c + (m22 * m33 - m32**2) * d) / determinant
    dp = (-m32 * m44 * b + (m22 * m44 - m42**2) * c + m32 * m42 * d) / determinant
    per, per_angle = speed**2 / LENGTH, speed**2 / LENGTH**2
    return np.array([a / (M + M_X) * per, dv * per, dr * per_angle, dp * per_angle, x[3], x[2]])


def run(helm: Helm, duration: float, *, step: float = 0.5, within: int = 2) -> Record:
    """Free run from 8 m/s and 80 rpm by Runge-Kutta; the helm gives rudder (rad) and revolutions per second."""
    count = round(duration / step)
    rows = np.zeros((count, 6))
    x = np.array([8.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    delta, (asked, n), h = 0.0, helm(0.0, 0.0, 0.0), step / within
    for k in range(count):
        rows[k] = (*x[:3], x[5], delta, n)
        asked, n = helm(k * step, float(x[5]), asked)
        for _ in range(within):
            after = delta + float(np.clip(asked - delta, -RUDDER_RATE * h, RUDDER_RATE * h))
            a = accelerations(x, delta, n)
            b = accelerations(x + h / 2 * a, (delta + after) / 2, n)
            c = accelerations(x + h / 2 * b, (delta + after) / 2, n)
            d = accelerations(x + h * c, after, n)
            x, delta = x + h / 6 * (a + 2 * b + 2 * c + d), after
    t = np.arange(count) * step
    return Record(t, rows[:, :3], rows[:, 3], {"rudder": rows[:, 4], "n": rows[:, 5]})
