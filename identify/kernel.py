"""The compiled heart: right-hand side, rollout and rollout with sensitivities, for any model, from a table.

The state is ``[x, y, psi, u, v, r, e1, e2]``: position and heading over ground, velocities of the hull through the
water, and two extra states that a model or an effect may use. Accelerations are sums of products of factors
(``identify.term.FACTORS``, then the channels made from the inputs), each times a coefficient. Nothing is recompiled
for another model: the table is data. Over a step an input is a straight line with the true input's mean and first
moment, so that a switch within the step moves velocity, heading and position by what it should.

Sensitivities are those of the discrete scheme itself, carried along with the state (forward mode), so they are exact
for the numbers that the rollout gives.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

#: Number of states.
NX = 8
#: Number of sensor parameters: heading bias, gyro bias, gyro scale, antenna x, y, clocks of position, heading, yaw
#: rate, velocity.
NM = 9

# measurement kinds
POSITION, HEADING, YAW_RATE, VELOCITY = 0, 1, 2, 3

_TINY = 1e-3


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def factors(z, channels, slope, part, wind, current, u0, q):
    """Fill ``q`` with every factor at state ``z`` (8,), ``part`` (-1 … 1) of a half step from the step's middle."""
    u, v, r = z[3], z[4], z[5]
    speed = math.sqrt(u * u + v * v)
    q[0] = 1.0
    q[1], q[2], q[3] = u, v, r
    q[4], q[5], q[6] = abs(u), abs(v), abs(r)
    q[7] = speed
    q[8] = u - u0
    q[9] = 1.0 / max(speed, _TINY)
    q[10], q[11] = z[6], z[7]
    c, s = math.cos(z[2]), math.sin(z[2])
    wn, we = wind[0] - current[0], wind[1] - current[1]
    wx, wy = wn * c + we * s - u, -wn * s + we * c - v
    air = math.sqrt(wx * wx + wy * wy)
    q[12], q[13] = air * wx, air * wy
    for k in range(channels.shape[0]):
        q[14 + k] = channels[k] + part * slope[k]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def derivative(z, current, equation, which, product, coefficients, q, f):
    """Time derivative of the state from the factors in ``q``."""
    c, s = math.cos(z[2]), math.sin(z[2])
    f[0] = z[3] * c - z[4] * s + current[0]
    f[1] = z[3] * s + z[4] * c + current[1]
    f[2] = z[5]
    for i in range(3, NX):
        f[i] = 0.0
    for m in range(equation.shape[0]):
        value = coefficients[which[m]]
        for k in range(product.shape[1]):
            if product[m, k] == 0:
                break
            value *= q[product[m, k]]
        f[3 + equation[m]] += value


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def rollout(
    z0, h, euler, channels, slopes, wind, current, u0, equation, which, product, coefficients, states, rates
):
    """One free run; fills ``states`` (n+1, 8) and ``rates`` (n+1, 8) and returns the number of good steps."""
    n = channels.shape[0]
    q = np.empty(14 + channels.shape[1])
    k1, k2, k3, k4, zz = np.empty(NX), np.empty(NX), np.empty(NX), np.empty(NX), np.empty(NX)
    z = z0.copy()
    for i in range(n):
        factors(z, channels[i], slopes[i], 0.0 if euler else -1.0, wind[i], current, u0, q)
        derivative(z, current, equation, which, product, coefficients, q, k1)
        for j in range(NX):  # an assignment of whole rows would take seconds to compile
            states[i, j], rates[i, j] = z[j], k1[j]
        if euler:
            for j in range(NX):
                z[j] += h * k1[j]
        else:
            for j in range(NX):
                zz[j] = z[j] + 0.5 * h * k1[j]
            factors(zz, channels[i], slopes[i], 0.0, wind[i], current, u0, q)
            derivative(zz, current, equation, which, product, coefficients, q, k2)
            for j in range(NX):
                zz[j] = z[j] + 0.5 * h * k2[j]
            factors(zz, channels[i], slopes[i], 0.0, wind[i], current, u0, q)
            derivative(zz, current, equation, which, product, coefficients, q, k3)
            for j in range(NX):
                zz[j] = z[j] + h * k3[j]
            factors(zz, channels[i], slopes[i], 1.0, wind[i], current, u0, q)
            derivative(zz, current, equation, which, product, coefficients, q, k4)
            for j in range(NX):
                z[j] += h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])
        good = True
        for j in range(3, NX):
            good = good and abs(z[j]) < 1e3
        if not good:
            for k in range(i + 1, n + 1):
                for j in range(NX):
                    states[k, j] = rates[k, j] = np.nan
            return i
    factors(z, channels[n - 1], slopes[n - 1], 1.0, wind[n - 1], current, u0, q)
    derivative(z, current, equation, which, product, coefficients, q, k1)
    for j in range(NX):
        states[n, j], rates[n, j] = z[j], k1[j]
    return n


@njit(cache=True, nogil=True)
def oscillator(step, force):
    """States (n + 1, 2) of a linear oscillator from rest; ``step`` (3, 3) advances (state, force) by one step."""
    out = np.zeros((force.shape[0] + 1, 2))
    for i in range(force.shape[0]):
        out[i + 1, 0] = step[0, 0] * out[i, 0] + step[0, 1] * out[i, 1] + step[0, 2] * force[i]
        out[i + 1, 1] = step[1, 0] * out[i, 0] + step[1, 1] * out[i, 1] + step[1, 2] * force[i]
    return out


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def population(
    z0, h, euler, channels, slopes, wind, current, u0, equation, which, product, coefficients, states
):
    """Free runs of a whole population of coefficients (m, p) from the same state; fills ``states`` (m, n+1, 8)."""
    rates = np.empty((channels.shape[0] + 1, NX))
    for i in range(coefficients.shape[0]):
        rollout(
            z0,
            h,
            euler,
            channels,
            slopes,
            wind,
            current,
            u0,
            equation,
            which,
            product,
            coefficients[i],
            states[i],
            rates,
        )


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def linearise(z, current, wind, equation, which, product, coefficients, q, f, phi, jacobian, by_channel):
    """Derivative with its Jacobians.

    ``phi`` (p,) value of each coefficient's regressor; ``jacobian`` (5, 6) of the accelerations with respect to
    (psi, u, v, r, e1, e2); ``by_channel`` (5, nc + 2) with respect to the channels and the air's velocity.
    """
    derivative(z, current, equation, which, product, coefficients, q, f)
    nq = q.shape[0]
    by_factor = np.zeros((5, nq))
    for j in range(phi.shape[0]):
        phi[j] = 0.0
    n_most = product.shape[1]
    for m in range(equation.shape[0]):
        value = 1.0
        count = 0
        for k in range(n_most):
            if product[m, k] == 0:
                break
            value *= q[product[m, k]]
            count += 1
        phi[which[m]] += value
        c = coefficients[which[m]]
        for k in range(count):
            part = c
            for other in range(count):
                if other != k:
                    part *= q[product[m, other]]
            by_factor[equation[m], product[m, k]] += part
    u, v, r = z[3], z[4], z[5]
    su, sv, sr = np.sign(u), np.sign(v), np.sign(r)
    speed = max(q[7], 1e-9)
    gu, gv = u / speed, v / speed
    inv = -q[9] * q[9] if q[7] > _TINY else 0.0
    cs, sn = math.cos(z[2]), math.sin(z[2])
    wn, we = wind[0] - current[0], wind[1] - current[1]
    wx, wy = wn * cs + we * sn - u, -wn * sn + we * cs - v
    air = math.sqrt(wx * wx + wy * wy)
    safe = max(air, 1e-9)
    # derivatives of air·wx, air·wy with respect to wx, wy
    xx, xy, yy = air + wx * wx / safe, wx * wy / safe, air + wy * wy / safe
    nc = by_channel.shape[1] - 2
    for e in range(5):
        g = by_factor[e]
        jacobian[e, 0] = g[12] * (xx * (wy + v) - xy * (wx + u)) + g[13] * (xy * (wy + v) - yy * (wx + u))
        jacobian[e, 1] = g[1] + g[4] * su + (g[7] + inv * g[9]) * gu + g[8] - g[12] * xx - g[13] * xy
        jacobian[e, 2] = g[2] + g[5] * sv + (g[7] + inv * g[9]) * gv - g[12] * xy - g[13] * yy
        jacobian[e, 3] = g[3] + g[6] * sr
        jacobian[e, 4] = g[10]
        jacobian[e, 5] = g[11]
        for k in range(nc):
            by_channel[e, k] = g[14 + k]
        by_channel[e, nc] = g[12] * (xx * cs - xy * sn) + g[13] * (xy * cs - yy * sn)
        by_channel[e, nc + 1] = g[12] * (xx * sn + xy * cs) + g[13] * (xy * sn + yy * cs)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz", "reassoc"})
def tangent(
    z,
    s,
    phi,
    jacobian,
    by_channel,
    simple,
    equation_of,
    d_coefficient,
    d_channel,
    d_slope,
    part,
    d_current,
    out,
):
    """Tangent of the derivative along every direction: ``s`` (8, nd) to ``out`` (8, nd).

    The first 8 directions are the initial state, then ``simple`` (coefficient indices), then the general ones with
    their own derivative of coefficients (ng, p), channels and air (nc + 2, ng) and current (2, ng).
    """
    c, sn = math.cos(z[2]), math.sin(z[2])
    a, b = -z[3] * sn - z[4] * c, z[3] * c - z[4] * sn
    nd = s.shape[1]
    for d in range(nd):
        out[0, d] = c * s[3, d] - sn * s[4, d] + a * s[2, d]
        out[1, d] = sn * s[3, d] + c * s[4, d] + b * s[2, d]
        out[2, d] = s[5, d]
    for e in range(5):
        j0, j1, j2 = jacobian[e, 0], jacobian[e, 1], jacobian[e, 2]
        j3, j4, j5 = jacobian[e, 3], jacobian[e, 4], jacobian[e, 5]
        for d in range(nd):
            out[3 + e, d] = j0 * s[2, d] + j1 * s[3, d] + j2 * s[4, d] + j3 * s[5, d]
        if j4 != 0.0 or j5 != 0.0:
            for d in range(nd):
                out[3 + e, d] += j4 * s[6, d] + j5 * s[7, d]
    base = NX
    for i in range(simple.shape[0]):
        out[3 + equation_of[simple[i]], base + i] += phi[simple[i]]
    base += simple.shape[0]
    nc = by_channel.shape[1]
    for g in range(d_coefficient.shape[0]):
        out[0, base + g] += d_current[0, g]
        out[1, base + g] += d_current[1, g]
        for j in range(phi.shape[0]):
            if d_coefficient[g, j] != 0.0:
                out[3 + equation_of[j], base + g] += d_coefficient[g, j] * phi[j]
    if d_channel.shape[1]:
        for e in range(5):
            for k in range(nc):
                weight = by_channel[e, k]
                if weight != 0.0:
                    for g in range(d_channel.shape[1]):
                        out[3 + e, base + g] += weight * d_channel[k, g]
                    if part != 0.0 and k < nc - 2:
                        for g in range(d_channel.shape[1]):
                            out[3 + e, base + g] += weight * part * d_slope[k, g]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz", "reassoc"})
def sensitivities(
    z0, h, euler, channels, slopes, wind, current, u0, equation, which, product, coefficients,
    simple, equation_of, d_coefficient, d_channel, d_slope, d_current, states, rates, s_all, f_all, by_all,
):  # fmt: skip
    """One free run with the sensitivities of states (``s_all`` (n+1, 8, nd)) and of rates (``f_all``).

    ``d_channel`` (n, nc + 2, ng), ``d_slope`` (n, nc, ng); ``by_all`` (n, 3, nc) receives the derivatives of u̇, v̇, ṙ
    with respect to the channels. Returns the number of good steps.
    """
    n, nc = channels.shape
    nd = s_all.shape[2]
    q = np.empty(14 + nc)
    f = np.empty(NX)
    phi = np.empty(coefficients.shape[0])
    jacobian = np.empty((5, 6))
    by_channel = np.empty((5, nc + 2))
    ks = np.empty((4, NX))
    kd = np.empty((4, NX, nd))
    zz = np.empty(NX)
    ss = np.empty((NX, nd))
    z = z0.copy()
    s = np.zeros((NX, nd))
    for j in range(NX):
        s[j, j] = 1.0
    stages = 1 if euler else 4
    for i in range(n + 1):
        last = i == n
        row = n - 1 if last else i
        for stage in range(stages):
            if stage == 0:
                for j in range(NX):
                    zz[j] = z[j]
                    for d in range(nd):
                        ss[j, d] = s[j, d]
            else:
                a = h if stage == 3 else 0.5 * h
                for j in range(NX):
                    zz[j] = z[j] + a * ks[stage - 1, j]
                    for d in range(nd):
                        ss[j, d] = s[j, d] + a * kd[stage - 1, j, d]
            part = 0.0
            if not euler and (stage == 0 or stage == 3):
                part = -1.0 if stage == 0 and not last else 1.0
            factors(zz, channels[row], slopes[row], part, wind[row], current, u0, q)
            linearise(
                zz,
                current,
                wind[row],
                equation,
                which,
                product,
                coefficients,
                q,
                f,
                phi,
                jacobian,
                by_channel,
            )
            for j in range(NX):
                ks[stage, j] = f[j]
            tangent(zz, ss, phi, jacobian, by_channel, simple, equation_of, d_coefficient, d_channel[row],
                    d_slope[row], part, d_current, kd[stage])  # fmt: skip
            if stage == 0:
                for j in range(NX):
                    states[i, j], rates[i, j] = z[j], f[j]
                    for d in range(nd):
                        s_all[i, j, d], f_all[i, j, d] = s[j, d], kd[0, j, d]
                for j in range(3):
                    for k in range(nc):
                        by_all[row, j, k] = by_channel[j, k]
                if last:
                    return n
        good = True
        for j in range(NX):
            if euler:
                z[j] += h * ks[0, j]
            else:
                z[j] += h / 6.0 * (ks[0, j] + 2.0 * ks[1, j] + 2.0 * ks[2, j] + ks[3, j])
            if j > 2:
                good = good and abs(z[j]) < 1e3
            if euler:
                for d in range(nd):
                    s[j, d] += h * kd[0, j, d]
            else:
                for d in range(nd):
                    s[j, d] += h / 6.0 * (kd[0, j, d] + 2.0 * kd[1, j, d] + 2.0 * kd[2, j, d] + kd[3, j, d])
        if not good:
            return i
    return n


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz", "reassoc"})
def normal_equations(
    h, states, rates, s_all, f_all, by_all, step, fraction, kind, observed, weight, within,
    sensor, d_sensor, used, moment, residual,
):  # fmt: skip
    """Add every measurement of one window to its moment matrix.

    Parameters
    ----------
    step, fraction : (m,)
        Place of each measurement on the window's grid.
    kind : (m,)
        POSITION and VELOCITY have two rows, the others one; ``observed`` (m, 2), ``weight`` (m,) = 1/σ.
    within : (m, nc)
        Integral of each channel from the step's begin to the sample less that of its straight line.
    sensor : (9,), d_sensor : (9, nd)
        Sensor parameters and their derivatives along each direction.
    used : (9,) bool
        Which sensor parameters have any derivative.
    moment : (nd + 1, nd + 1)
        Receives the upper triangle of Σ [J e]ᵀ[J e], e = (observed - predicted)/σ.
    residual : (m, 2)
        Receives e (0 in unused places).
    """
    nd = s_all.shape[2]
    row = np.empty((2, nd + 1))
    z, f = np.empty(NX), np.empty(NX)
    s, fs = np.empty((NX, nd)), np.empty((NX, nd))
    for m in range(step.shape[0]):
        i, x = step[m], fraction[m]
        # between the grid points: cubic for what integrates a velocity, quadratic for the velocities themselves
        h00, h10 = (1 + 2 * x) * (1 - x) * (1 - x), x * (1 - x) * (1 - x) * h
        h01, h11 = x * x * (3 - 2 * x), x * x * (x - 1) * h
        for j in range(3):
            z[j] = h00 * states[i, j] + h10 * rates[i, j] + h01 * states[i + 1, j] + h11 * rates[i + 1, j]
            f[j] = (1 - x) * rates[i, j] + x * rates[i + 1, j]
            for d in range(nd):
                s[j, d] = (
                    h00 * s_all[i, j, d]
                    + h10 * f_all[i, j, d]
                    + h01 * s_all[i + 1, j, d]
                    + h11 * f_all[i + 1, j, d]
                )
        q0, q1, q2 = 1 - x * x, x * (1 - x) * h, x * x
        for j in range(3, 6):
            z[j] = q0 * states[i, j] + q1 * rates[i, j] + q2 * states[i + 1, j]
            f[j] = (1 - 2 * x) * rates[i, j] + 2 * x * (states[i + 1, j] - states[i, j]) / h
            for c in range(within.shape[1]):
                z[j] += by_all[i, j - 3, c] * within[m, c]
            for d in range(nd):
                s[j, d] = q0 * s_all[i, j, d] + q1 * f_all[i, j, d] + q2 * s_all[i + 1, j, d]
        k = kind[m]
        c, sn = math.cos(z[2]), math.sin(z[2])
        ax, ay = sensor[3], sensor[4]
        rows = 1
        if k == POSITION:
            rows = 2
            lx, ly = -sn * ax - c * ay, c * ax - sn * ay
            p0, p1 = z[0] + c * ax - sn * ay, z[1] + sn * ax + c * ay
            vx, vy = f[0] + lx * z[5], f[1] + ly * z[5]
            for d in range(nd):
                row[0, d] = s[0, d] + lx * s[2, d]
                row[1, d] = s[1, d] + ly * s[2, d]
            if used[3] or used[4]:
                for d in range(nd):
                    row[0, d] += c * d_sensor[3, d] - sn * d_sensor[4, d]
                    row[1, d] += sn * d_sensor[3, d] + c * d_sensor[4, d]
            if used[5]:
                for d in range(nd):
                    row[0, d] -= vx * d_sensor[5, d]
                    row[1, d] -= vy * d_sensor[5, d]
        elif k == VELOCITY:
            rows = 2
            lx, ly = -sn * ax - c * ay, c * ax - sn * ay
            p0, p1 = f[0] + lx * z[5], f[1] + ly * z[5]
            for j in range(2):
                for d in range(nd):
                    fs[j, d] = (1 - x) * f_all[i, j, d] + x * f_all[i + 1, j, d]
            for d in range(nd):
                row[0, d] = fs[0, d] + lx * s[5, d] - ly * z[5] * s[2, d]
                row[1, d] = fs[1, d] + ly * s[5, d] + lx * z[5] * s[2, d]
            if used[3] or used[4]:
                for d in range(nd):
                    row[0, d] += z[5] * (-sn * d_sensor[3, d] - c * d_sensor[4, d])
                    row[1, d] += z[5] * (c * d_sensor[3, d] - sn * d_sensor[4, d])
            if used[8]:
                gx = (rates[i + 1, 0] - rates[i, 0]) / h
                gy = (rates[i + 1, 1] - rates[i, 1]) / h
                for d in range(nd):
                    row[0, d] -= gx * d_sensor[8, d]
                    row[1, d] -= gy * d_sensor[8, d]
        elif k == HEADING:
            p0, p1 = z[2] + sensor[0], 0.0
            for d in range(nd):
                row[0, d] = s[2, d] + d_sensor[0, d] - f[2] * d_sensor[6, d]
        else:
            p0, p1 = sensor[2] * z[5] + sensor[1], 0.0
            for d in range(nd):
                row[0, d] = (
                    sensor[2] * s[5, d]
                    + d_sensor[1, d]
                    + z[5] * d_sensor[2, d]
                    - sensor[2] * f[5] * d_sensor[7, d]
                )
        w = weight[m]
        row[0, nd] = observed[m, 0] - p0
        row[1, nd] = observed[m, 1] - p1
        for q in range(rows):
            residual[m, q] = row[q, nd] * w
            for d in range(nd + 1):
                row[q, d] *= w
            for a in range(nd + 1):
                value = row[q, a]
                if value != 0.0:
                    for b in range(a, nd + 1):
                        moment[a, b] += value * row[q, b]
