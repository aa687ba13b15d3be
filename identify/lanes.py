"""A population in lanes: eight candidates abreast through the same tape."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from identify.aligned import aligned, zeros
from identify.angles import cosine_and_sine
from identify.flow import COLUMNS
from identify.flow_behind import flow
from identify.kernel import CHANNEL, FLOW, NX, PART, REACH, TINY, WEIGHT
from identify.simd import COMPILED, INLINED, WIDTH, absolute, larger, load, root, smaller, splat, store
from identify.tape import ROW, Tape
from identify.threads import abreast

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


class Driven(NamedTuple):
    """What drives a run: first state (8,), step, s, whether by explicit Euler steps, and as in ``kernel.free_run``."""

    first: FloatArray
    h: float
    euler: bool
    channels: FloatArray
    slopes: FloatArray
    wind: FloatArray
    current: FloatArray
    u0: float


class Compared(NamedTuple):
    """What runs are compared with: velocities (n + 1, 3), weights (3,), and the largest error that counts."""

    measured: FloatArray
    weight: FloatArray
    cap: float


_NOTHING = Compared(np.zeros((0, 3)), np.zeros(3), 0.0)


def population_in_lanes(tape: Tape, driven: Driven, coefficients: FloatArray, workers: int = 1) -> FloatArray:
    """Free runs of candidates (m, p) from the same state, by the rule of the kernel.

    Returns
    -------
    (m, n + 1, 8)
        What ran away is left as it is: large, infinite or NaN.
    """
    groups = -(-len(coefficients) // WIDTH)
    out = np.empty((WIDTH * groups, len(driven.channels) + 1, NX))
    _run_all(tape, driven, coefficients, _NOTHING, out, np.zeros(0), workers)
    return out[: len(coefficients)]


def misfits_in_lanes(
    tape: Tape, driven: Driven, coefficients: FloatArray, compared: Compared, workers: int = 1
) -> FloatArray:
    """Sums (m,) of squared weighted errors of u, v, r over free runs of candidates (m, p), nothing else kept."""
    total = np.zeros(-(-len(coefficients) // WIDTH) * WIDTH)
    _run_all(tape, driven, coefficients, compared, np.zeros((0, 0, NX)), total, workers)
    return total[: len(coefficients)]


def _run_all(
    tape: Tape, driven: Driven, coefficients: FloatArray, compared: Compared, out: FloatArray, total: FloatArray,
    workers: int,
) -> None:  # fmt: skip
    """Run all groups of candidates, shared among threads."""
    m = len(coefficients)
    every = np.zeros((-(-m // WIDTH) * WIDTH, tape.summands * ROW))
    for k, target in enumerate(tape.target):
        every[:m, target] += coefficients[:, k]
    used = np.unique(tape.target)
    order = used[np.argsort(used % ROW, kind="stable")]
    equations = np.searchsorted(order % ROW, np.arange(6)).astype(np.int64)
    place = _places(tape)[order // ROW]

    def run(k: int) -> None:
        lanes, q = aligned(every[k : k + WIDTH, order].T), zeros(tape.values, WIDTH)
        q[0] = 1.0
        _run(
            driven, tape.steps, place, equations, lanes, q, np.zeros(tape.values), zeros(2 * NX, WIDTH),
            compared, out[k : k + WIDTH], total[k : k + WIDTH],
        )  # fmt: skip

    groups = range(0, len(every), WIDTH)
    abreast(run, groups, workers if len(groups) > 1 else 1)


def _places(tape: Tape) -> FloatArray:
    """Flat place in the lanes' values of what each row of coefficients is multiplied with."""
    products = tape.steps.base + np.arange(len(tape.steps.left))
    return WIDTH * np.concatenate([products, tape.steps.single.astype(np.int64)])


@njit(**INLINED)
def _factors(u, v, r, psi, state, channels, slopes, row, part, north, east, u0, steps, q, alone):
    """Fill every factor and product ``q`` (values, WIDTH)."""
    store(q, WIDTH, u)
    store(q, 2 * WIDTH, v)
    store(q, 3 * WIDTH, r)
    store(q, 4 * WIDTH, absolute(u))
    store(q, 5 * WIDTH, absolute(v))
    store(q, 6 * WIDTH, absolute(r))
    store(q, 8 * WIDTH, u - u0)
    if steps.needs[0]:
        speed = root(u * u + v * v)
        store(q, 7 * WIDTH, speed)
        store(q, 9 * WIDTH, splat(1.0) / larger(speed, splat(TINY)))
    if steps.needs[1]:
        c, s = cosine_and_sine(psi)
        wx, wy = c * north + s * east - u, c * east - s * north - v
        air = root(wx * wx + wy * wy)
        store(q, 12 * WIDTH, air * wx)
        store(q, 13 * WIDTH, air * wy)
    if steps.needs[2]:
        store(q, 10 * WIDTH, load(state, 6 * WIDTH))
        store(q, 11 * WIDTH, load(state, 7 * WIDTH))
    for k in range(channels.shape[1]):
        store(q, (CHANNEL + k) * WIDTH, splat(channels[row, k] + part * slopes[row, k]))
    if steps.needs[3]:
        at = steps.base + steps.left.shape[0]
        for lane in range(WIDTH):
            for k in range(1, 4):
                alone[k] = q[k, lane]
            for k in range(channels.shape[1]):
                alone[CHANNEL + k] = q[CHANNEL + k, lane]
            flow(alone, steps.flow_place, steps.flow, at)
            for k in range(3):
                q[FLOW + k, lane] = alone[at + k * COLUMNS]
    left, right = steps.left, steps.right
    for k in range(left.shape[0]):
        one, other = WIDTH * np.int64(left[k]), WIDTH * np.int64(right[k])
        store(q, (steps.base + k) * WIDTH, load(q, one) * load(q, other))


@njit(**COMPILED)
def _run(driven, steps, place, equations, lanes, q, alone, work, compared, out, total):
    """Fill ``out`` (WIDTH, n + 1, 8) or add to ``total`` (WIDTH,); ``work`` (16, WIDTH): states, changes."""
    h, euler, channels, slopes, u0 = driven.h, driven.euler, driven.channels, driven.slopes, driven.u0
    wind, current, n, stages = driven.wind, driven.current, driven.channels.shape[0], 1 if driven.euler else 4
    for j in range(NX):
        store(work, j * WIDTH, splat(driven.first[j]))
    misfit = splat(0.0)
    for i in range(n + 1):
        if out.shape[0]:
            for lane in range(WIDTH):
                for j in range(NX):
                    out[lane, i, j] = work[j, lane]
        else:
            for j in range(3):
                error = (load(work, (3 + j) * WIDTH) - compared.measured[i, j]) * compared.weight[j]
                error = smaller(absolute(error), splat(compared.cap))
                misfit = misfit + error * error
        if i == n:
            break
        north, east = wind[i, 0] - current[0], wind[i, 1] - current[1]
        zp, zu, zv = load(work, 2 * WIDTH), load(work, 3 * WIDTH), load(work, 4 * WIDTH)
        zr, ze, zf = load(work, 5 * WIDTH), load(work, 6 * WIDTH), load(work, 7 * WIDTH)
        kp, ku, kv, kr, ke, kf = splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0)
        for j in range(NX):
            store(work, (NX + j) * WIDTH, splat(0.0))
        for stage in range(stages):
            reach, weight = h * REACH[stage], h if euler else h * WEIGHT[stage]
            psi, u, v, r = zp + kp * reach, zu + ku * reach, zv + kv * reach, zr + kr * reach
            store(work, 6 * WIDTH, ze + ke * reach)
            store(work, 7 * WIDTH, zf + kf * reach)
            part = 0.0 if euler else PART[stage]
            _factors(u, v, r, psi, work, channels, slopes, i, part, north, east, u0, steps, q, alone)
            kp = r
            ku, kv, kr = (
                _sum(0, equations, place, lanes, q),
                _sum(1, equations, place, lanes, q),
                _sum(2, equations, place, lanes, q),
            )
            if steps.needs[2]:
                ke, kf = _sum(3, equations, place, lanes, q), _sum(4, equations, place, lanes, q)
            if out.shape[0]:  # nothing depends on the position
                c, s = cosine_and_sine(psi)
                _add(work, 8, (u * c - v * s + current[0]) * weight)
                _add(work, 9, (u * s + v * c + current[1]) * weight)
            _add(work, 10, kp * weight)
            _add(work, 11, ku * weight)
            _add(work, 12, kv * weight)
            _add(work, 13, kr * weight)
            _add(work, 14, ke * weight)
            _add(work, 15, kf * weight)
        store(work, 6 * WIDTH, ze)
        store(work, 7 * WIDTH, zf)
        for j in range(NX):
            _add(work, j, load(work, (NX + j) * WIDTH))
    if not out.shape[0]:
        store(total, 0, load(total, 0) + misfit)


@njit(**INLINED)
def _add(work, j, value):
    """Add to one of the rows."""
    store(work, j * WIDTH, load(work, j * WIDTH) + value)


@njit(**INLINED)
def _sum(equation, equations, place, lanes, q):
    """One acceleration: its coefficients (m, WIDTH) times their values."""
    one, other = splat(0.0), splat(0.0)
    begin, end = equations[equation], equations[equation + 1]
    for k in range(begin, end - 1, 2):
        one = one + load(lanes, k * WIDTH) * load(q, place[k])
        other = other + load(lanes, (k + 1) * WIDTH) * load(q, place[k + 1])
    if (end - begin) % 2:
        one = one + load(lanes, (end - 1) * WIDTH) * load(q, place[end - 1])
    return one + other
