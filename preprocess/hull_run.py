"""A hull with all usual terms, run freely from a first state, with the sensitivities of what it does.

    u̇ = (1, u, u|u|, u³, vr, v², r², forces) · θ_u
    v̇ = (1, v, v|v|, r, r|r|, uv, ur, |v|r, |r|v, u|u|, forces) · θ_v
    ṙ = the same · θ_r
    ẋ, ẏ = R(ψ)(u, v) + current,  ψ̇ = r

with u and v through the water. Forces of an input c are in proportion to c, |c|c, c² and c(u² + v²). More terms than
any one vessel has: what is asked of the model is to leave nothing of the motion to an offset of clocks, not to be known
itself.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from preprocess.kalman import IntArray
from preprocess.trial import FloatArray

#: Terms of the hull in the order of ``_terms``; those of surge, and those of sway and of yaw.
TERMS = 15
SURGE = (0, 1, 2, 3, 10, 11, 12)
TURN = (0, 4, 5, 6, 7, 8, 9, 13, 14, 2)
#: Columns of forces per input.
PER_INPUT = 4
#: Sensitivities behind those to the coefficients: the inputs' offset and the current; then the first state.
BEYOND, STATE = 3, 6


def free_terms(inputs: int) -> tuple[IntArray, IntArray]:
    """Equation and term of every coefficient, (p,) each."""
    acting = tuple(range(TERMS, TERMS + PER_INPUT * inputs))
    both = [(e, f) for e, terms in enumerate((SURGE, TURN, TURN)) for f in (*terms, *acting)]
    equation, term = np.ascontiguousarray(np.array(both, dtype=np.int64).T)
    return equation, term


def terms_of(motion: FloatArray, force: FloatArray) -> FloatArray:
    """All terms (n, k) at velocities (n, 3) under forces (n, inputs, 3)."""
    count = TERMS + PER_INPUT * force.shape[1]
    out, slope = np.zeros((len(motion), count)), np.zeros((count, 3))
    _all_terms(np.ascontiguousarray(motion), np.ascontiguousarray(force), out, slope)
    return out


@njit(cache=True)
def _terms(u, v, r, force, out, slope):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Terms (k,) and their slopes in u, v, r (k, 3); ``force`` (inputs, 3): averages of c, |c|c, c²."""
    au, av, ar = abs(u), abs(v), abs(r)
    out[0], out[1], out[2], out[3] = 1.0, u, u * au, u * u * u
    out[4], out[5], out[6], out[7] = v, v * av, r, r * ar
    out[8], out[9], out[10], out[11] = u * v, u * r, v * r, v * v
    out[12], out[13], out[14] = r * r, av * r, ar * v
    slope[1, 0], slope[2, 0], slope[3, 0] = 1.0, 2.0 * au, 3.0 * u * u
    slope[4, 1], slope[5, 1], slope[6, 2], slope[7, 2] = 1.0, 2.0 * av, 1.0, 2.0 * ar
    slope[8, 0], slope[8, 1], slope[9, 0], slope[9, 2] = v, u, r, u
    slope[10, 1], slope[10, 2], slope[11, 1], slope[12, 2] = r, v, 2.0 * v, 2.0 * r
    slope[13, 1], slope[13, 2] = np.sign(v) * r, av
    slope[14, 1], slope[14, 2] = ar, np.sign(r) * v
    k = TERMS
    for i in range(force.shape[0]):
        for j in range(3):
            out[k + j] = force[i, j]
        out[k + 3] = force[i, 0] * (u * u + v * v)
        slope[k + 3, 0], slope[k + 3, 1] = 2.0 * force[i, 0] * u, 2.0 * force[i, 0] * v
        k += PER_INPUT


@njit(cache=True)
def _all_terms(motion, force, out, slope):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    for i in range(len(motion)):
        _terms(motion[i, 0], motion[i, 1], motion[i, 2], force[i], out[i], slope)


@njit(cache=True)
def _rate(s, theta, force, current, dx, jacobian, terms, slope):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Rate of the state (6,) and its Jacobian (6, 6)."""
    c, d = np.cos(s[2]), np.sin(s[2])
    u, v, r = s[3], s[4], s[5]
    dx[0], dx[1], dx[2] = u * c - v * d + current[0], u * d + v * c + current[1], r
    jacobian[0, 2], jacobian[0, 3], jacobian[0, 4] = -u * d - v * c, c, -d
    jacobian[1, 2], jacobian[1, 3], jacobian[1, 4] = u * c - v * d, d, c
    jacobian[2, 5] = 1.0
    _terms(u, v, r, force, terms, slope)
    for e in range(3):
        total, a0, a1, a2 = 0.0, 0.0, 0.0, 0.0
        for k in range(len(terms)):
            w = theta[e, k]
            if w != 0.0:
                total += w * terms[k]
                a0 += w * slope[k, 0]
                a1 += w * slope[k, 1]
                a2 += w * slope[k, 2]
        dx[3 + e] = total
        jacobian[3 + e, 3], jacobian[3 + e, 4], jacobian[3 + e, 5] = a0, a1, a2


@njit(cache=True)
def _sensitivity(s, jacobian, terms, theta, later, speed2, equation, term, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Rate of the sensitivities ``s`` (6, p)."""
    p = len(equation)
    for e in range(2):
        for k in range(s.shape[1]):
            out[e, k] = jacobian[e, 2] * s[2, k] + jacobian[e, 3] * s[3, k] + jacobian[e, 4] * s[4, k]
    for k in range(s.shape[1]):
        out[2, k] = s[5, k]
    for e in range(3, 6):
        for k in range(s.shape[1]):
            out[e, k] = jacobian[e, 3] * s[3, k] + jacobian[e, 4] * s[4, k] + jacobian[e, 5] * s[5, k]
    for k in range(p):
        out[3 + equation[k], k] += terms[term[k]]
    for e in range(3):
        for i in range(later.shape[0]):
            at = TERMS + PER_INPUT * i
            for j in range(3):
                out[3 + e, p] += theta[e, at + j] * later[i, j]
            out[3 + e, p] += theta[e, at + 3] * later[i, 0] * speed2
    out[0, p + 1] += 1.0
    out[1, p + 2] += 1.0


@njit(cache=True)
def _keep(x, s, states, slopes, i):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Put a state and its sensitivities at ``i``; element by element compiles in a quarter of the time."""
    for a in range(6):
        states[i, a] = x[a]
        for b in range(s.shape[1]):
            slopes[i, a, b] = s[a, b]


@njit(cache=True)
def _run(theta, first, current, force, later, step, equation, term, states, slopes):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    n, width = force.shape[0], slopes.shape[2]
    count = TERMS + PER_INPUT * force.shape[1]
    terms, slope, jacobian = np.zeros(count), np.zeros((count, 3)), np.zeros((6, 6))
    k, ks = np.zeros((4, 6)), np.zeros((4, 6, width))
    s, x, at, moved = np.zeros((6, width)), np.zeros(6), np.zeros(6), np.zeros((6, width))
    for j in range(6):
        x[j], s[j, width - 6 + j] = first[j], 1.0
    _keep(x, s, states, slopes, 0)
    share = np.array([0.0, 0.5, 0.5, 1.0])
    for i in range(n):
        for stage in range(4):
            h = share[stage] * step
            for a in range(6):
                at[a] = x[a] + h * k[stage - 1, a]
                for b in range(width):
                    moved[a, b] = s[a, b] + h * ks[stage - 1, a, b]
            _rate(at, theta, force[i], current, k[stage], jacobian, terms, slope)
            speed2 = at[3] * at[3] + at[4] * at[4]
            _sensitivity(moved, jacobian, terms, theta, later[i], speed2, equation, term, ks[stage])
        for a in range(6):
            x[a] += step / 6.0 * (k[0, a] + 2.0 * k[1, a] + 2.0 * k[2, a] + k[3, a])
            for b in range(width):
                s[a, b] += step / 6.0 * (ks[0, a, b] + 2.0 * ks[1, a, b] + 2.0 * ks[2, a, b] + ks[3, a, b])
        _keep(x, s, states, slopes, i + 1)


def sail(
    theta: FloatArray,
    first: FloatArray,
    current: FloatArray,
    force: FloatArray,
    later: FloatArray,
    step: float,
) -> tuple[FloatArray, FloatArray]:
    """Run one window.

    Parameters
    ----------
    theta : (3, k)
        Coefficients by equation and term.
    first : (6,)
        x, y, ψ, u, v, r at the start.
    current : (2,) m/s
        To the north and east.
    force, later : (n, inputs, 3)
        Averages of c, |c|c and c² in each step, and how they change with the offset of the inputs, per second.
    step : float

    Returns
    -------
    states : (n + 1, 6)
    slopes : (n + 1, 6, p)
        By the coefficients (``free_terms``), the offset of the inputs, the current, the first state.
    """
    equation, term = free_terms(force.shape[1])
    n, width = len(force), len(equation) + BEYOND + STATE
    states, slopes = np.empty((n + 1, 6)), np.empty((n + 1, 6, width))
    arrays = (np.ascontiguousarray(x, dtype=float) for x in (theta, first, current, force, later))
    _run(*arrays, step, equation, term, states, slopes)
    return states, slopes


@njit(cache=True)
def put_between(slopes, column, at, x, turning, gain, unit, more, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Put a state's sensitivities between steps, times gain and unit, in ``out``, ``more`` columns before the last six.

    With ``turning``, unless it is empty, what it moves by those of ψ is added.
    """
    width = slopes.shape[2]
    for i in range(len(at)):
        here, y = at[i], 1.0 - x[i]
        for k in range(width):
            slope = y * slopes[here, column, k] + x[i] * slopes[here + 1, column, k]
            if len(turning):
                slope += turning[i] * (y * slopes[here, 2, k] + x[i] * slopes[here + 1, 2, k])
            out[i, k if k < width - STATE else k + more] = gain * slope * unit[i]
