"""The compiled heart: accelerations from a tape of products, and a free run, for any model.

The state is ``[x, y, psi, u, v, r, e1, e2]``: position and heading over ground, velocities of the hull through the
water, and two extra states that a model or an effect may use. Accelerations are sums of products of factors
(``identify.term.FACTORS``, then the channels made from the inputs), each times a coefficient. Nothing is recompiled
for another model: the tape is data. Over a step an input is a straight line with the true input's mean and first
moment, so that a switch within the step moves velocity, heading and position by what it should.

The five accelerations lie abreast in one vector, so that a product serves all of them at once; sines and cosines of
the headings, on which nothing else depends unless there is wind, are taken for many steps at a time afterwards.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from identify.aligned import zeros
from identify.angles import cosine_and_sine
from identify.flow import COLUMNS, RESULTS
from identify.flow_behind import flow
from identify.simd import (
    COMPILED,
    INLINED,
    lane,
    load,
    load_like,
    put,
    splat,
    splat_half,
    store,
    take,
    widened,
)
from identify.tape import ROW, Tape
from identify.term import FACTORS

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Number of states.
NX = 8
#: Number of sensor parameters: heading bias, gyro bias, gyro scale, antenna x, y, clocks of position, heading, yaw
#: rate, velocity.
NM = 9

# measurement kinds
POSITION, HEADING, YAW_RATE, VELOCITY = 0, 1, 2, 3

#: Place of the first channel among the factors.
CHANNEL = len(FACTORS)
#: Place of the first factor that the flow behind the hull gives.
FLOW = FACTORS.index(RESULTS[0])
#: A speed below this counts as this where something is divided by it, m/s.
TINY = 1e-3
#: A velocity above this has run away.
FAR = 1e3

#: The fourth-order rule of Runge and Kutta: how far each stage reaches, where in the step it looks, what it weighs.
REACH = np.array([0.0, 0.5, 0.5, 1.0])
PART = np.array([-1.0, 0.0, 0.0, 1.0])
WEIGHT = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0


@njit(**INLINED)
def evaluate(velocities, psi, channels, slopes, row, part, north, east, u0, steps, q):
    """Fill ``q`` with every factor at ``velocities``, u, v, r, e1, e2 abreast, and heading ``psi``.

    ``channels`` and ``slopes`` (n, nc) at ``row``, ``part`` (-1 … 1) of a half step from the step's middle; ``north``
    and ``east`` the velocity of the air over the water.
    """
    u, v, r = lane(velocities, 0), lane(velocities, 1), lane(velocities, 2)
    q[1], q[2], q[3] = u, v, r
    q[4], q[5], q[6] = abs(u), abs(v), abs(r)
    q[8] = u - u0
    if steps.needs[0]:
        speed = math.sqrt(u * u + v * v)
        q[7], q[9] = speed, 1.0 / max(speed, TINY)
    if steps.needs[1]:
        c, s = math.cos(psi), math.sin(psi)
        wx, wy = north * c + east * s - u, -north * s + east * c - v
        air = math.sqrt(wx * wx + wy * wy)
        q[12], q[13] = air * wx, air * wy
    if steps.needs[2]:
        q[10], q[11] = lane(velocities, 3), lane(velocities, 4)
    width = channels.shape[1]
    for k in range(width):
        put(q, CHANNEL + k, take(channels, row * width + k) + part * take(slopes, row * width + k))
    if steps.needs[3]:
        at = steps.base + steps.left.shape[0]
        flow(q, steps.flow_place, steps.flow, at)
        for k in range(3):
            q[FLOW + k] = q[at + k * COLUMNS]


@njit(**INLINED)
def accelerations(rows, steps, q):
    """Fill the products in ``q``, and return the five accelerations abreast."""
    if steps.needs[2]:
        return _sums(rows, steps, q, splat(0.0))
    return widened(_sums(rows, steps, q, splat_half(0.0)))


@njit(**INLINED)
def _sums(rows, steps, q, zero):
    """Fill the products in ``q``, and return the first accelerations abreast, as many as ``zero`` has places."""
    left, right, single, base = steps.left, steps.right, steps.single, steps.base
    a, b, c, d = zero, zero, zero, zero
    n = left.shape[0]
    for k in range(0, single.shape[0], 4):
        a = a + load_like(zero, rows, (n + k) * ROW) * take(q, take(single, k))
        b = b + load_like(zero, rows, (n + k) * ROW + 8) * take(q, take(single, k + 1))
        c = c + load_like(zero, rows, (n + k) * ROW + 16) * take(q, take(single, k + 2))
        d = d + load_like(zero, rows, (n + k) * ROW + 24) * take(q, take(single, k + 3))
    for k in range(0, n, 4):
        value = take(q, take(left, k)) * take(q, take(right, k))
        put(q, base + k, value)
        a = a + load_like(zero, rows, k * ROW) * value
        value = take(q, take(left, k + 1)) * take(q, take(right, k + 1))
        put(q, base + k + 1, value)
        b = b + load_like(zero, rows, k * ROW + 8) * value
        value = take(q, take(left, k + 2)) * take(q, take(right, k + 2))
        put(q, base + k + 2, value)
        c = c + load_like(zero, rows, k * ROW + 16) * value
        value = take(q, take(left, k + 3)) * take(q, take(right, k + 3))
        put(q, base + k + 3, value)
        d = d + load_like(zero, rows, k * ROW + 24) * value
    return (a + b) + (c + d)


class Scratch(NamedTuple):
    """Places to work in: values of the tape, velocities (8,), what every stage met (3, m), displacements (2, 8)."""

    q: FloatArray
    state: FloatArray
    at: FloatArray
    moved: FloatArray


def scratch_for(tape: Tape, n: int) -> Scratch:
    """Places to work in over ``n`` steps; the constant factor is in its place."""
    q = zeros(tape.values)
    q[0] = 1.0
    return Scratch(q, zeros(ROW), zeros(3, 4 * n + 8), zeros(2, 8))


def free_run(
    tape: Tape, first: FloatArray, h: float, euler: bool, channels: FloatArray, slopes: FloatArray, wind: FloatArray,
    current: FloatArray, u0: float, coefficients: FloatArray,
) -> FloatArray:  # fmt: skip
    """States (n + 1, 8) of one free run from ``first`` (8,); NaN after running away.

    Parameters
    ----------
    tape : Tape
    h : float
        Step, s; ``euler`` takes explicit Euler steps with the inputs' means instead of the fourth-order rule.
    channels, slopes : (n, nc)
        Of each step's straight line: its mean, and its end less that.
    wind, current : (n, 2), (2,)
        Velocity of the air and of the water, m/s.
    u0 : float
        Speed about which the model is written, m/s.
    coefficients : (p,)
    """
    states = np.empty((len(channels) + 1, NX))
    rollout(
        first, h, euler, channels, slopes, wind, current, u0, tape.steps, tape.rows(coefficients), states,
        scratch_for(tape, len(channels)),
    )  # fmt: skip
    return states


def accelerations_at(
    tape: Tape, state: FloatArray, channels: FloatArray, wind: FloatArray, current: FloatArray, u0: float,
    coefficients: FloatArray,
) -> FloatArray:  # fmt: skip
    """Accelerations (5,) of u, v, r, e1, e2 at a state (8,), with channels (nc,), air (2,) and water (2,)."""
    out, channels = np.empty(NX), channels[None]
    derivative(
        state, 0, 0.0, channels, np.zeros_like(channels), wind, current, u0, tape.steps, tape.rows(coefficients),
        scratch_for(tape, 1), out,
    )  # fmt: skip
    return out[3:]


@njit(**COMPILED)
def derivative(z, row, part, channels, slopes, wind, current, u0, steps, rows, scratch, out):
    """Time derivative ``out`` (8,) of a state ``z`` (8,), ``part`` (-1 … 1) of a half step from a step's middle.

    The step is ``row``; ``wind`` (2,) is the velocity of the air then; the other parameters are those of ``rollout``.
    """
    for j in range(5):
        scratch.state[j] = z[3 + j]
    north, east = wind[0] - current[0], wind[1] - current[1]
    velocities = load(scratch.state, 0)
    evaluate(velocities, z[2], channels, slopes, row, part, north, east, u0, steps, scratch.q)
    store(scratch.moved, 0, accelerations(rows, steps, scratch.q))
    c, s = math.cos(z[2]), math.sin(z[2])
    out[0], out[1], out[2] = z[3] * c - z[4] * s + current[0], z[3] * s + z[4] * c + current[1], z[5]
    for j in range(5):
        out[3 + j] = scratch.moved[0, j]


@njit(**COMPILED)
def rollout(first, h, euler, channels, slopes, wind, current, u0, steps, rows, states, scratch):
    """Fill ``states`` (n + 1, 8) as ``free_run`` returns them, and return the number of good steps."""
    n = channels.shape[0]
    q, state, at, stages = scratch.q, scratch.state, scratch.at, 1 if euler else 4
    psi, width = first[2], at.shape[1]
    for j in range(5):
        state[j] = first[3 + j]
    z = load(state, 0)
    done = n
    for i in range(n):
        states[i, 2] = psi
        for j in range(5):
            states[i, 3 + j] = state[j]
        north, east = wind[i, 0] - current[0], wind[i, 1] - current[1]
        k, total, turn, turned = splat(0.0), splat(0.0), 0.0, 0.0
        for stage in range(stages):
            reach, weight = h * REACH[stage], 1.0 if euler else WEIGHT[stage]
            met = z + k * reach
            heading = psi + turn * reach
            place = stages * i + stage
            put(at, place, lane(met, 0))
            put(at, width + place, lane(met, 1))
            put(at, 2 * width + place, heading)
            part = 0.0 if euler else PART[stage]
            evaluate(met, heading, channels, slopes, i, part, north, east, u0, steps, q)
            k = accelerations(rows, steps, q)
            total = total + k * weight
            turn = lane(met, 2)
            turned += turn * weight
        z = z + total * h
        psi += turned * h
        store(state, 0, z)
        far = max(max(abs(state[0]), abs(state[1])), max(abs(state[2]), max(abs(state[3]), abs(state[4]))))
        if not far < FAR:
            done = i
            break
    if done == n:
        states[n, 2] = psi
        for j in range(5):
            states[n, 3 + j] = state[j]
    else:
        for i in range(done + 1, n + 1):
            for j in range(NX):
                states[i, j] = np.nan
    _positions(first, h, euler, current, at, states, done, scratch.moved)
    return done


@njit(**INLINED)
def _positions(first, h, euler, current, at, states, done, moved):
    """Fill the positions up to step ``done``, from velocities and headings ``at`` (3, m) every stage of every step."""
    stages, width = 1 if euler else 4, at.shape[1]
    for j in range(8):
        moved[0, j] = h if euler else h * WEIGHT[j % 4]
    weights = load(moved, 0)
    x, y = first[0], first[1]
    states[0, 0], states[0, 1] = x, y
    for begin in range(0, done, 8 // stages):
        c, s = cosine_and_sine(load(at, 2 * width + begin * stages))
        u, v = load(at, begin * stages), load(at, width + begin * stages)
        store(moved, 0, (u * c - v * s) * weights)
        store(moved, 8, (u * s + v * c) * weights)
        for i in range(begin, min(begin + 8 // stages, done)):
            for j in range(stages):
                x += moved[0, stages * (i - begin) + j]
                y += moved[1, stages * (i - begin) + j]
            x += h * current[0]
            y += h * current[1]
            states[i + 1, 0], states[i + 1, 1] = x, y


@njit(cache=True, nogil=True)
def oscillator(step, force):
    """States (n + 1, 2) of a linear oscillator from rest; ``step`` (3, 3) advances (state, force) by one step."""
    out = np.zeros((force.shape[0] + 1, 2))
    for i in range(force.shape[0]):
        out[i + 1, 0] = step[0, 0] * out[i, 0] + step[0, 1] * out[i, 1] + step[0, 2] * force[i]
        out[i + 1, 1] = step[1, 0] * out[i, 0] + step[1, 1] * out[i, 1] + step[1, 2] * force[i]
    return out
