"""From a run with its sensitivities to the moments of what was measured, window by window, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from identify.kernel import HEADING, NX, POSITION, VELOCITY
from identify.simd import load, store
from identify.tangents import sensitivities

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Rows that are taken into the moments together.
BATCH = 8


class Motion(NamedTuple):
    """What drives a stretch, for the compiled code; see ``identify.drive.Drive`` and ``identify.tape.Tape``."""

    h: float
    euler: bool
    u0: float
    channels: FloatArray
    slopes: FloatArray
    fine: FloatArray
    wind: FloatArray
    current: FloatArray
    rows: FloatArray


class Sensing(NamedTuple):
    """The samples of a stretch, and how the sensors see.

    ``t`` (m,) on the stretch's grid, in s from its begin, clocks' offsets off; ``kind`` (m,); ``value`` (m, 2);
    ``weight`` (m,) = 1/σ; ``sensor`` (9,) parameters, ``along`` (9, width) their derivatives along every column,
    ``used`` (9,) which have any.
    """

    t: FloatArray
    kind: IntArray
    value: FloatArray
    weight: FloatArray
    sensor: FloatArray
    along: FloatArray
    used: IntArray


@njit(cache=True, nogil=True, _nrt=False, error_model="numpy", fastmath={"contract", "nsz"})
def moments_of_windows(
    first, begin, length, samples, motion, steps, along, sensing, run, batch, moment, moments, residual
):
    """Moments of every window: fills ``moments`` (w, c + 1, c + 1) and ``residual`` (m, 2).

    ``first`` (w, 8) first states, ``begin`` and ``length`` (w,) steps, ``samples`` (w, 2) first and last sample;
    ``batch`` (BATCH, width) and ``moment`` (width, width) are places to work in. A window that runs away gets NaN.
    """
    m = motion
    last = moments.shape[1] - 1
    for w in range(begin.shape[0]):
        done = sensitivities(
            first[w], begin[w], length[w], m.h, m.euler, m.channels, m.slopes, m.wind, m.current, m.u0, steps,
            m.rows, along, run,
        )  # fmt: skip
        for a in range(last + 1):
            for b in range(last + 1):
                moments[w, a, b] = 0.0
        if done < length[w]:
            moments[w, last, last] = np.nan
            continue
        _window(
            begin[w], length[w], samples[w, 0], samples[w, 1], m, sensing, run, batch, moment, residual, last
        )
        for a in range(last + 1):
            for b in range(a + 1):
                moments[w, a, b] = moments[w, b, a] = moment[b, a]


@njit(cache=True, nogil=True, _nrt=False, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def _window(begin, length, low, high, motion, sensing, run, batch, moment, residual, last):
    width = batch.shape[1]
    for a in range(width):
        for b in range(width):
            moment[a, b] = 0.0
    filled = 0
    for m in range(low, high):
        place = sensing.t[m] / motion.h - begin
        i = min(max(math.floor(place), 0), length - 1)
        x = place - i
        rows = 2 if sensing.kind[m] == POSITION or sensing.kind[m] == VELOCITY else 1
        _rows(i, x, begin, m, motion, sensing, run, batch, filled, last)
        for q in range(rows):
            residual[m, q] = batch[filled + q, last]
        filled += rows
        if filled > BATCH - 2:
            _take(batch, moment, filled, last)
            filled = 0
    _take(batch, moment, filled, last)


@njit(cache=True, nogil=True, _nrt=False, error_model="numpy", fastmath={"contract", "nsz"})
def _take(batch, moment, filled, last):
    """Add the products of the rows of a batch to the upper triangle of the moments."""
    width = batch.shape[1]
    for q in range(filled, BATCH):
        for a in range(width):
            batch[q, a] = 0.0
    for a in range(last + 1):
        for o in range(a - a % 8, width, 8):
            one = batch[0, a] * load(batch, o) + batch[1, a] * load(batch, width + o)
            two = batch[2, a] * load(batch, 2 * width + o) + batch[3, a] * load(batch, 3 * width + o)
            one = one + batch[4, a] * load(batch, 4 * width + o) + batch[5, a] * load(batch, 5 * width + o)
            two = two + batch[6, a] * load(batch, 6 * width + o) + batch[7, a] * load(batch, 7 * width + o)
            store(moment, a * width + o, load(moment, a * width + o) + (one + two))


@njit(cache=True, nogil=True, _nrt=False, error_model="numpy", fastmath={"contract", "nsz"})
def _interpolated(j, i, x, begin, motion, run):
    """State ``j`` and its rate between the grid points: cubic for what integrates a velocity, else quadratic."""
    states, rates, h = run.states, run.rates, motion.h
    here, there = states[i, j], states[i + 1, j]
    if j < 3:
        z = (1 + 2 * x) * (1 - x) * (1 - x) * here + x * (1 - x) * (1 - x) * h * rates[i, j]
        z += x * x * (3 - 2 * x) * there + x * x * (x - 1) * h * rates[i + 1, j]
        return z, (1 - x) * rates[i, j] + x * rates[i + 1, j]
    z = (1 - x * x) * here + x * (1 - x) * h * rates[i, j] + x * x * there
    inside = min(max(x, 0.0), 1.0)
    parts = motion.fine.shape[0] // motion.channels.shape[0]
    whole = int(inside * parts)
    for c in range(motion.channels.shape[1]):
        # integral of the channel from the step's begin, less that of the straight line
        total = 0.0
        for k in range(whole):
            total += motion.fine[(begin + i) * parts + k, c]
        if whole < parts:
            total += (inside * parts - whole) * motion.fine[(begin + i) * parts + whole, c]
        line = motion.channels[begin + i, c] * inside + motion.slopes[begin + i, c] * (
            inside * inside - inside
        )
        z += run.by_channel[i, j - 3, c] * h * (total / parts - line)
    return z, (1 - 2 * x) * rates[i, j] + 2 * x * (there - here) / h


@njit(cache=True, nogil=True, _nrt=False, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def _smooth(j, i, x, h, o, run):
    """Tangents of position or heading ``j`` between the grid points, eight columns from ``o``."""
    width = run.s.shape[2]
    here = (i * NX + j) * width + o
    there = here + NX * width
    value = load(run.s, here) * ((1 + 2 * x) * (1 - x) * (1 - x)) + load(run.f, here) * (
        x * (1 - x) * (1 - x) * h
    )
    return value + (load(run.s, there) * (x * x * (3 - 2 * x)) + load(run.f, there) * (x * x * (x - 1) * h))


@njit(cache=True, nogil=True, _nrt=False, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def _bent(j, i, x, h, o, run):
    """Tangents of velocity ``j`` between the grid points."""
    width = run.s.shape[2]
    here = (i * NX + j) * width + o
    value = load(run.s, here) * (1 - x * x) + load(run.f, here) * (x * (1 - x) * h)
    return value + load(run.s, here + NX * width) * (x * x)


@njit(cache=True, nogil=True, _nrt=False, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def _straight(j, i, x, o, run):
    """Tangents of the rate of ``j`` between the grid points."""
    width = run.s.shape[2]
    here = (i * NX + j) * width + o
    return load(run.f, here) * (1 - x) + load(run.f, here + NX * width) * x


@njit(cache=True, nogil=True, _nrt=False, error_model="numpy", fastmath={"contract", "nsz"})
def _rows(i, x, begin, m, motion, sensing, run, batch, filled, last):
    """One measurement's derivatives and error, both times its weight, into rows of the batch."""
    h, sensor, used, along = motion.h, sensing.sensor, sensing.used, sensing.along
    width, k, weight = batch.shape[1], sensing.kind[m], sensing.weight[m]
    one, other = filled * width, (filled + 1) * width
    psi, turn = _interpolated(2, i, x, begin, motion, run)
    r, rr = _interpolated(5, i, x, begin, motion, run)
    c, s = math.cos(psi), math.sin(psi)
    ax, ay = sensor[3], sensor[4]
    lx, ly = -s * ax - c * ay, c * ax - s * ay
    p0, p1 = 0.0, 0.0
    if k == POSITION:
        px, vx = _interpolated(0, i, x, begin, motion, run)
        py, vy = _interpolated(1, i, x, begin, motion, run)
        p0, p1, vx, vy = px + ly, py - lx, vx + lx * r, vy + ly * r
        for o in range(0, width, 8):
            by_psi = _smooth(2, i, x, h, o, run)
            a, b = _smooth(0, i, x, h, o, run) + by_psi * lx, _smooth(1, i, x, h, o, run) + by_psi * ly
            if used[3] or used[4]:
                dx, dy = load(along, 3 * width + o), load(along, 4 * width + o)
                a, b = a + (dx * c - dy * s), b + (dx * s + dy * c)
            if used[5]:
                late = load(along, 5 * width + o)
                a, b = a - late * vx, b - late * vy
            store(batch, one + o, a * weight)
            store(batch, other + o, b * weight)
    elif k == VELOCITY:
        px, vx = _interpolated(0, i, x, begin, motion, run)
        py, vy = _interpolated(1, i, x, begin, motion, run)
        p0, p1 = vx + lx * r, vy + ly * r
        gx, gy = (run.rates[i + 1, 0] - run.rates[i, 0]) / h, (run.rates[i + 1, 1] - run.rates[i, 1]) / h
        for o in range(0, width, 8):
            by_psi, by_r = _smooth(2, i, x, h, o, run), _bent(5, i, x, h, o, run)
            a = _straight(0, i, x, o, run) + (by_r * lx - by_psi * (ly * r))
            b = _straight(1, i, x, o, run) + (by_r * ly + by_psi * (lx * r))
            if used[3] or used[4]:
                dx, dy = load(along, 3 * width + o), load(along, 4 * width + o)
                a, b = a - (dx * s + dy * c) * r, b + (dx * c - dy * s) * r
            if used[8]:
                late = load(along, 8 * width + o)
                a, b = a - late * gx, b - late * gy
            store(batch, one + o, a * weight)
            store(batch, other + o, b * weight)
    elif k == HEADING:
        p0 = psi + sensor[0]
        for o in range(0, width, 8):
            a = _smooth(2, i, x, h, o, run) + (load(along, o) - load(along, 6 * width + o) * turn)
            store(batch, one + o, a * weight)
    else:
        p0 = sensor[2] * r + sensor[1]
        for o in range(0, width, 8):
            a = _bent(5, i, x, h, o, run) * sensor[2] + (
                load(along, width + o) + load(along, 2 * width + o) * r
            )
            store(batch, one + o, (a - load(along, 7 * width + o) * (sensor[2] * rr)) * weight)
    batch[filled, last] = (sensing.value[m, 0] - p0) * weight
    if k in (POSITION, VELOCITY):
        batch[filled + 1, last] = (sensing.value[m, 1] - p1) * weight
