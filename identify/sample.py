"""What a sample says of a run: its error, and what its derivatives are summed from, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from identify.aligned import places
from identify.innovations import Filter
from identify.kernel import HEADING, NX, POSITION, VELOCITY, YAW_RATE
from identify.simd import INLINED, load, splat, store

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Rows that are taken into the moments together.
BATCH = 8
#: What a row is summed from: tangents, tangents of the rates, derivatives of the sensors' parameters; at most so many
#: of each.
SOURCES, MOST = 3, 8


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
    ``used`` (9,) which have any; ``known`` how a drift of the positions, and waves, are taken off, where there are any.
    """

    t: FloatArray
    kind: IntArray
    value: FloatArray
    weight: FloatArray
    sensor: FloatArray
    along: FloatArray
    used: IntArray
    known: Filter


class Whitens(NamedTuple):
    """What makes the rows of windows white, see ``identify.whitening.Whitening``.

    ``batches`` (n,) of eight rows each: of every vector that a window uses eight numbers; ``place`` (w,) where a
    window's begin; by ``shrink`` (w, K) rows count less along each vector.
    """

    batches: FloatArray
    place: IntArray
    shrink: FloatArray


def nothing_white(windows: int) -> Whitens:
    """What leaves the rows of so many windows as they are."""
    return Whitens(np.zeros(0), np.zeros(windows, dtype=np.int64), np.zeros((windows, 0)))


class Work(NamedTuple):
    """Places to work in.

    ``batch`` (BATCH, width) rows of derivatives and error, ``moment`` (width, width) their products, ``projected``
    (K, width) their sums along a window's vectors; for the row in hand ``place`` and
    ``weight`` (SOURCES, MOST) flat places of its summands and their weights, ``counts`` (SOURCES,) how many there are;
    ``states`` (D, width) what is known of a drift and waves in every column, ``after`` (D, width) as it is carried on.
    """

    batch: FloatArray
    moment: FloatArray
    projected: FloatArray
    place: IntArray
    weight: FloatArray
    counts: IntArray
    states: FloatArray
    after: FloatArray


def work_for(width: int, basis: int = 0, states: int = 0) -> Work:
    """Places to work in for rows of ``width``, a basis of so many, and so many states of what is known."""
    batch, moment, projected, before, after = places(
        (BATCH, width), (width, width), (basis, width), (states, width), (states, width)
    )
    return Work(
        batch, moment, projected, np.zeros((SOURCES, MOST), dtype=np.int64),
        np.zeros((SOURCES, MOST)), np.zeros(SOURCES, dtype=np.int64), before, after,
    )  # fmt: skip


@njit(**INLINED)
def sum_row(weight, along, run, work, filled):
    """Put the sum of the row's summands, times ``weight``, in its place in the batch."""
    width, place, by = work.batch.shape[1], work.place, work.weight
    for o in range(0, width, 8):
        total = splat(0.0)
        for k in range(work.counts[0]):
            total = total + load(run.s, place[0, k] + o) * by[0, k]
        for k in range(work.counts[1]):
            total = total + load(run.f, place[1, k] + o) * by[1, k]
        for k in range(work.counts[2]):
            total = total + load(along, place[2, k] + o) * by[2, k]
        store(work.batch, filled * width + o, total * weight)


@njit(**INLINED)
def _add(source, place, weight, work):
    """One more summand of the row."""
    k = work.counts[source]
    work.place[source, k], work.weight[source, k] = place, weight
    work.counts[source] = k + 1


@njit(**INLINED)
def _state(j, factor, i, x, h, work):
    """Tangents of state ``j`` between the grid points: cubic for what integrates a velocity, else quadratic."""
    width = work.batch.shape[1]
    here = (i * NX + j) * width
    there = here + NX * width
    if j < 3:
        _add(np.int64(0), here, factor * (1 + 2 * x) * (1 - x) * (1 - x), work)
        _add(np.int64(0), there, factor * x * x * (3 - 2 * x), work)
        _add(np.int64(1), here, factor * x * (1 - x) * (1 - x) * h, work)
        _add(np.int64(1), there, factor * x * x * (x - 1) * h, work)
    else:
        _add(np.int64(0), here, factor * (1 - x * x), work)
        _add(np.int64(0), there, factor * x * x, work)
        _add(np.int64(1), here, factor * x * (1 - x) * h, work)


@njit(**INLINED)
def _interpolated(j, i, x, begin, motion, run):
    """State ``j`` and its rate between the grid points, as ``_state`` its tangents."""
    states, rates, h = run.states, run.rates, motion.h
    here, there = states[i, j], states[i + 1, j]
    if j < 3:
        z = (1 + 2 * x) * (1 - x) * (1 - x) * here + x * (1 - x) * (1 - x) * h * rates[i, j]
        z += x * x * (3 - 2 * x) * there + x * x * (x - 1) * h * rates[i + 1, j]
        return z, (1 - x) * rates[i, j] + x * rates[i + 1, j]
    z = (1 - x * x) * here + x * (1 - x) * h * rates[i, j] + x * x * there
    inside = min(max(x, 0.0), 1.0)
    parts = motion.fine.shape[1] // motion.channels.shape[0]
    whole = int(inside * parts)
    for c in range(motion.channels.shape[1]):
        # integral of the channel from the step's begin, less that of the straight line
        total = 0.0
        for k in range(whole):
            total += motion.fine[c, (begin + i) * parts + k]
        if whole < parts:
            total += (inside * parts - whole) * motion.fine[c, (begin + i) * parts + whole]
        line = motion.channels[begin + i, c] * inside + motion.slopes[begin + i, c] * (
            inside * inside - inside
        )
        z += run.by_channel[i, j - 3, c] * h * (total / parts - line)
    return z, (1 - 2 * x) * rates[i, j] + 2 * x * (there - here) / h


@njit(**INLINED)
def pose_at(kind, i, x, begin, motion, sensing, run):
    """Heading and yaw rate, each with its rate, and cosine and sine of the heading, as far as the kind needs them."""
    sensor, used = sensing.sensor, sensing.used
    psi = turn = r = change = s = 0.0
    c = 1.0
    if kind in (YAW_RATE, VELOCITY) or used[5]:
        r, change = _interpolated(np.int64(5), i, x, begin, motion, run)
    if kind in (HEADING, VELOCITY) or _armed(sensor, used):
        psi, turn = _interpolated(np.int64(2), i, x, begin, motion, run)
    if kind in (POSITION, VELOCITY) and _armed(sensor, used):
        c, s = math.cos(psi), math.sin(psi)
    return psi, turn, r, change, c, s


@njit(**INLINED)
def _armed(sensor, used):
    """Whether the antenna is away from the origin, or may be."""
    return sensor[3] != 0.0 or sensor[4] != 0.0 or used[3] or used[4]


@njit(**INLINED)
def row_of(axis, pose, i, x, begin, m, motion, sensing, run, work):
    """Error of one measurement (along ``axis``, where it has two); what its derivatives are summed from is noted."""
    sensor, used, k = sensing.sensor, sensing.used, sensing.kind[m]
    width, h = work.batch.shape[1], motion.h
    heading, turning, one = np.int64(2), np.int64(5), np.int64(1)
    for q in range(SOURCES):
        work.counts[q] = 0
    psi, turn, r, change, c, s = pose
    if k == YAW_RATE:
        _state(turning, sensor[2], i, x, h, work)
        _by_sensor(1, 1.0, sensing, work)
        _by_sensor(2, r, sensing, work)
        _by_sensor(7, -sensor[2] * change, sensing, work)
        return sensing.value[m, 0] - (sensor[2] * r + sensor[1])
    if k == HEADING:
        _state(heading, 1.0, i, x, h, work)
        _by_sensor(0, 1.0, sensing, work)
        _by_sensor(6, -turn, sensing, work)
        return sensing.value[m, 0] - (psi + sensor[0])
    # where the antenna is from the origin, north and east, and what a turn moves it by
    ahead, aside = c * sensor[3] - s * sensor[4], s * sensor[3] + c * sensor[4]
    at, arm, x_arm, y_arm = (ahead, -aside, c, -s) if axis == 0 else (aside, ahead, s, c)
    place, speed = _interpolated(axis, i, x, begin, motion, run)
    if k == POSITION:
        _state(axis, 1.0, i, x, h, work)
        if _armed(sensor, used):
            _state(heading, arm, i, x, h, work)
        _by_sensor(3, x_arm, sensing, work)
        _by_sensor(4, y_arm, sensing, work)
        _by_sensor(5, -(speed + arm * r), sensing, work)
        return sensing.value[m, axis] - (place + at)
    here = (i * NX + axis) * width
    _add(one, here, 1 - x, work)
    _add(one, here + NX * width, x, work)
    if _armed(sensor, used):
        _state(turning, arm, i, x, h, work)
        _state(heading, -at * r, i, x, h, work)
    _by_sensor(3, r * (-s if axis == 0 else c), sensing, work)
    _by_sensor(4, r * (-c if axis == 0 else -s), sensing, work)
    _by_sensor(8, -(run.rates[i + 1, axis] - run.rates[i, axis]) / h, sensing, work)
    return sensing.value[m, axis] - (speed + arm * r)


@njit(**INLINED)
def _by_sensor(which, weight, sensing, work):
    """One more summand of the row, where any column moves this parameter of the sensors."""
    if sensing.used[which]:
        _add(np.int64(2), which * work.batch.shape[1], weight, work)
