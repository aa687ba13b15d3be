"""A free run with its sensitivities: those of the discrete scheme itself, so exact for the numbers that it gives.

At every stage the accelerations' derivatives with respect to all values of the tape follow by going through it
backwards, for all five equations abreast. With them, the tangents of the state go through the step, eight directions
abreast: the first state, then the parameters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from identify.aligned import places
from identify.angles import cosine_and_sine
from identify.kernel import (
    CHANNEL,
    FAR,
    NX,
    PART,
    REACH,
    WEIGHT,
    accelerations,
    evaluate,
)
from identify.linearise import backwards, forcing, jacobian_of
from identify.simd import COMPILED, INLINED, WIDTH, lane, load, splat, store
from identify.tape import ROW, Tape

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Rows of forcing at every stage: five accelerations, two velocities of the position.
FORCED = 7
#: Columns of the Jacobian: u, v, r, e1, e2, heading.
COLUMNS = 6


class Along(NamedTuple):
    """The directions that are followed beside the first state, column by column.

    Attributes
    ----------
    column, value, equation, weight : (m,)
        Of every plain coefficient: its column, the value of the tape that it multiplies, its equation, and a factor.
    moved, moved_value, moved_equation, moved_weight : (k,)
        The same for coefficients that another parameter moves.
    general : (g,)
        Columns of the parameters that are no plain coefficients.
    driven_place, driven_column : (d,)
        Channels (by their place among the factors; 12 and 13 are the air's velocity, north and east) that a parameter
        moves, and its column; ``driven``, ``driven_slope`` (n, d) their derivatives at every step.
    current : (2, width)
        Derivative of the water's velocity along every column.
    """

    column: IntArray
    value: IntArray
    equation: IntArray
    weight: FloatArray
    moved: IntArray
    moved_value: IntArray
    moved_equation: IntArray
    moved_weight: FloatArray
    general: IntArray
    driven_place: IntArray
    driven_column: IntArray
    driven: FloatArray
    driven_slope: FloatArray
    current: FloatArray


class Run(NamedTuple):
    """What a run with sensitivities leaves, for up to n steps and ``width`` columns.

    ``states``, ``rates`` (n + 1, 8); ``s``, ``f`` (n + 1, 8, width) their derivatives; ``by_channel`` (n, 3, nc) those
    of the accelerations with respect to the channels at each step's begin. The rest are places to work in.
    """

    states: FloatArray
    rates: FloatArray
    s: FloatArray
    f: FloatArray
    by_channel: FloatArray
    q: FloatArray
    state: FloatArray
    at: FloatArray
    adjoint: FloatArray
    jacobian: FloatArray
    turn: FloatArray
    force: FloatArray


def run_for(tape: Tape, n: int, width: int, channels: int) -> Run:
    """Places for a run of up to ``n`` steps; ``width`` is a multiple of eight."""
    s, f, q, *others = places(
        (n + 1, NX, width), (n + 1, NX, width), (tape.values,), (ROW,), (8, 8), (tape.values, ROW),
        (4, COLUMNS, ROW), (4, 4), (4, FORCED, width),
    )  # fmt: skip
    q[0] = 1.0
    states, rates, by_channel = np.empty((n + 1, NX)), np.empty((n + 1, NX)), np.empty((n, 3, channels))
    return Run(states, rates, s, f, by_channel, q, *others)


def padded(columns: int) -> int:
    """Columns rounded up to what is worked on abreast."""
    return -(-columns // WIDTH) * WIDTH


@njit(**INLINED)
def _advance(i, stages, h, steps, run):
    """Tangents over step ``i``; with no stage left to go only those of the rates."""
    s, f, jac, turn, force = run.s, run.f, run.jacobian, run.turn, run.force
    width = s.shape[2]
    for o in range(0, width, 8):
        here = i * NX * width + o
        sp, su, sv = load(s, here + 2 * width), load(s, here + 3 * width), load(s, here + 4 * width)
        sr, se, sf = load(s, here + 5 * width), load(s, here + 6 * width), load(s, here + 7 * width)
        kp, ku, kv, kr, ke, kf = splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0)
        tx, ty, tp, tu, tv = splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0)
        tr, te, tf = splat(0.0), splat(0.0), splat(0.0)
        for m in range(max(stages, 1)):
            reach, weight = h * REACH[m], 1.0 if stages == 1 else WEIGHT[m]
            p, u, v, r = sp + kp * reach, su + ku * reach, sv + kv * reach, sr + kr * reach
            g = m * FORCED * width + o
            kp = r
            ku = u * jac[m, 0, 0] + v * jac[m, 1, 0] + (r * jac[m, 2, 0] + load(force, g))
            kv = u * jac[m, 0, 1] + v * jac[m, 1, 1] + (r * jac[m, 2, 1] + load(force, g + width))
            kr = u * jac[m, 0, 2] + v * jac[m, 1, 2] + (r * jac[m, 2, 2] + load(force, g + 2 * width))
            if steps.needs[1]:
                ku, kv, kr = ku + p * jac[m, 5, 0], kv + p * jac[m, 5, 1], kr + p * jac[m, 5, 2]
            if steps.needs[2]:
                a, b = se + ke * reach, sf + kf * reach
                ku = ku + (a * jac[m, 3, 0] + b * jac[m, 4, 0])
                kv = kv + (a * jac[m, 3, 1] + b * jac[m, 4, 1])
                kr = kr + (a * jac[m, 3, 2] + b * jac[m, 4, 2])
                ke = u * jac[m, 0, 3] + v * jac[m, 1, 3] + (r * jac[m, 2, 3] + load(force, g + 3 * width))
                kf = u * jac[m, 0, 4] + v * jac[m, 1, 4] + (r * jac[m, 2, 4] + load(force, g + 4 * width))
                ke = ke + (a * jac[m, 3, 3] + b * jac[m, 4, 3]) + p * jac[m, 5, 3]
                kf = kf + (a * jac[m, 3, 4] + b * jac[m, 4, 4]) + p * jac[m, 5, 4]
                te, tf = te + ke * weight, tf + kf * weight
            kx = u * turn[m, 0] - v * turn[m, 1] + (p * turn[m, 2] + load(force, g + 5 * width))
            ky = u * turn[m, 1] + v * turn[m, 0] + (p * turn[m, 3] + load(force, g + 6 * width))
            if m == 0:
                store(f, here, kx)
                store(f, here + width, ky)
                store(f, here + 2 * width, kp)
                store(f, here + 3 * width, ku)
                store(f, here + 4 * width, kv)
                store(f, here + 5 * width, kr)
            tx, ty, tp = tx + kx * weight, ty + ky * weight, tp + kp * weight
            tu, tv, tr = tu + ku * weight, tv + kv * weight, tr + kr * weight
        if stages:
            there = here + NX * width
            store(s, there, load(s, here) + tx * h)
            store(s, there + width, load(s, here + width) + ty * h)
            store(s, there + 2 * width, sp + tp * h)
            store(s, there + 3 * width, su + tu * h)
            store(s, there + 4 * width, sv + tv * h)
            store(s, there + 5 * width, sr + tr * h)
            store(s, there + 6 * width, se + te * h)
            store(s, there + 7 * width, sf + tf * h)


@njit(**INLINED)
def _begin(first, along, run):
    """Put the first state and its tangents in their places."""
    for j in range(NX):
        run.states[0, j] = first[j]
        for d in range(run.s.shape[2]):
            run.s[0, j, d] = 1.0 if d == j else 0.0
    for stage in range(4):
        for e in range(FORCED):
            for d in range(run.s.shape[2]):
                run.force[stage, e, d] = along.current[e - 5, d] if e > 4 else 0.0
    for j in range(5):
        run.state[j] = first[3 + j]


@njit(**INLINED)
def _turn(stages, run):
    """Cosine and sine of every stage's heading, and what the velocities become when it turns."""
    at, turn = run.at, run.turn
    cosine, sine = cosine_and_sine(load(at, 16))
    u, v = load(at, 0), load(at, 8)
    store(at, 32, cosine)
    store(at, 40, sine)
    store(at, 48, splat(0.0) - (u * sine + v * cosine))
    store(at, 56, u * cosine - v * sine)
    for m in range(stages):
        for j in range(4):
            turn[m, j] = at[4 + j, m]


@njit(**COMPILED)
def sensitivities(first, begin, n, h, euler, channels, slopes, wind, current, u0, steps, rows, along, run):
    """One free run of ``n`` steps from step ``begin`` of what drives it, with its sensitivities; fills ``run``.

    Parameters are those of ``identify.kernel.free_run``. Returns the number of good steps.
    """
    q, state, at, turn, states, rates = run.q, run.state, run.at, run.turn, run.states, run.rates
    nc = channels.shape[1]
    _begin(first, along, run)
    z, x, y, psi = load(state, 0), first[0], first[1], first[2]
    for i in range(n + 1):
        row, last = begin + min(i, n - 1), i == n
        stages = 1 if euler or last else 4
        north, east = wind[row, 0] - current[0], wind[row, 1] - current[1]
        k, total, yaw, turned = splat(0.0), splat(0.0), 0.0, 0.0
        for stage in range(stages):
            reach, weight = h * REACH[stage], 1.0 if euler else WEIGHT[stage]
            part = 0.0 if euler else (1.0 if last else PART[stage])
            met = z + k * reach
            store(state, 0, met)
            heading = psi + yaw * reach
            at[0, stage], at[1, stage], at[2, stage] = lane(met, 0), lane(met, 1), heading
            evaluate(met, heading, channels, slopes, row, part, north, east, u0, steps, q)
            k = accelerations(rows, steps, q)
            backwards(rows, steps, q, run.adjoint)
            jacobian_of(steps, q, heading, north, east, run.adjoint, run.jacobian, stage * COLUMNS * ROW)
            forcing(along, row, part, q, run.adjoint, run.force, stage)
            yaw = lane(met, 2)
            turned += yaw * weight
            total = total + k * weight
            if stage == 0:
                store(at, 3 * ROW, k)
                for j in range(5):
                    states[i, 3 + j], rates[i, 3 + j] = state[j], at[3, j]
                for j in range(3):
                    for c in range(nc):
                        run.by_channel[row - begin, j, c] = run.adjoint[CHANNEL + c, j]
        _turn(stages, run)
        states[i, 0], states[i, 1], states[i, 2] = x, y, psi
        rates[i, 0], rates[i, 1], rates[i, 2] = turn[0, 3] + current[0], current[1] - turn[0, 2], states[i, 5]
        _advance(i, 0 if last else stages, h, steps, run)
        if last:
            return n
        for stage in range(stages):
            weight = h if euler else h * WEIGHT[stage]
            x += weight * (turn[stage, 3] + current[0])
            y += weight * (current[1] - turn[stage, 2])
        z = z + total * h
        psi += turned * h
        store(state, 0, z)
        far = max(max(abs(state[0]), abs(state[1])), max(abs(state[2]), max(abs(state[3]), abs(state[4]))))
        if not far < FAR:
            return i
    return n
