"""From a run with its sensitivities to the moments of what was measured, or its rows, by windows, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identify.kernel import POSITION, VELOCITY
from identify.sample import BATCH, pose_at, row_of, sum_row
from identify.simd import COMPILED, INLINED, load, store, take
from identify.tangents import sensitivities


@njit(**COMPILED)
def moments_of_windows(
    first,
    begin,
    length,
    samples,
    motion,
    steps,
    along,
    sensing,
    whitens,
    run,
    work,
    moments,
    residual,
    since,
    rows,
):
    """Moments of every window: fills ``moments`` (w, c + 1, c + 1) and ``residual`` (m, 2), or ``rows`` (m, 2, k).

    ``first`` (w, 8) first states, ``begin`` and ``length`` (w,) steps, ``samples`` (w, 2) first and last sample. Rows
    lose what is known of a drift, and are made white by what ``whitens`` them; the errors are left as they are. A
    window that runs away gets NaN. With any columns in ``rows``, these are the weighted derivatives of every sample
    from column ``since`` on (zeros where a window runs away), and the moments mean nothing: compiled in one, since to
    compile the run with its sensitivities twice takes two seconds of a first call.
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
        used = _used(whitens.shrink, w)
        _window(
            begin[w], length[w], samples[w, 0], samples[w, 1], m, sensing, whitens.batches, whitens.place[w], used,
            run, work, residual, last, since, rows,
        )  # fmt: skip
        _whiten(whitens.shrink, w, used, work, last)
        for a in range(last + 1):
            for b in range(a + 1):
                moments[w, a, b] = moments[w, b, a] = work.moment[b, a]


@njit(**INLINED)
def _used(shrink, w):
    """How many vectors of its basis a window uses."""
    count = shrink.shape[1]
    while count > 0 and shrink[w, count - 1] == 0.0:
        count -= 1
    return count


@njit(**INLINED)
def _project(batches, first, used, work):
    """Add the rows of a batch to their sums along the vectors, whose numbers there begin at ``first``."""
    width, batch = work.batch.shape[1], work.batch
    for o in range(0, width, 8):
        a, b = load(batch, o), load(batch, width + o)
        c, d = load(batch, 2 * width + o), load(batch, 3 * width + o)
        e, f = load(batch, 4 * width + o), load(batch, 5 * width + o)
        g, h = load(batch, 6 * width + o), load(batch, 7 * width + o)
        for k in range(used):
            x, at = first + k * BATCH, k * width + o
            one = a * take(batches, x) + b * take(batches, x + 1)
            two = c * take(batches, x + 2) + d * take(batches, x + 3)
            one = one + e * take(batches, x + 4) + f * take(batches, x + 5)
            two = two + g * take(batches, x + 6) + h * take(batches, x + 7)
            store(work.projected, at, load(work.projected, at) + (one + two))


@njit(**INLINED)
def _whiten(shrink, w, used, work, last):
    """Take off the moments what the rows have along the basis, as far as it is shrunk."""
    width = work.moment.shape[1]
    for k in range(used):
        for a in range(last + 1):
            by = shrink[w, k] * work.projected[k, a]
            for o in range(a - a % 8, width, 8):
                at = a * width + o
                store(work.moment, at, load(work.moment, at) - load(work.projected, k * width + o) * by)


@njit(**INLINED)
def _window(
    begin, length, low, high, motion, sensing, batches, first, used, run, work, residual, last, since, rows
):  # fmt: skip
    """Sum the products of all rows of one window, or put the rows where they are asked for."""
    width = work.batch.shape[1]
    for k in range(used):
        for a in range(width):
            work.projected[k, a] = 0.0
    for a in range(width):
        for b in range(width):
            work.moment[a, b] = 0.0
    for d in range(work.states.shape[0]):
        for a in range(width):
            work.states[d, a] = 0.0
    filled = np.int64(0)
    for m in range(low, high):
        place = sensing.t[m] / motion.h - begin
        i = min(max(math.floor(place), 0), length - 1)
        both = sensing.kind[m] == POSITION or sensing.kind[m] == VELOCITY
        pose = pose_at(sensing.kind[m], i, place - i, begin, motion, sensing, run)
        for axis in range(2 if both else 1):
            error = row_of(axis, pose, i, place - i, begin, m, motion, sensing, run, work)
            sum_row(sensing.weight[m], sensing.along, run, work, filled)
            residual[m, axis] = error * sensing.weight[m]
            if rows.shape[2] == 0:
                work.batch[filled, last] = residual[m, axis]
            if work.states.shape[0] and sensing.known.used[m]:
                _take_off(axis, m, filled, sensing.known, work)
            for k in range(rows.shape[2]):
                rows[m, axis, k] = work.batch[filled, since + k] if since + k < width else 0.0
            filled += 1
            if filled == BATCH:
                _take(work.batch, work.moment, last)
                _project(batches, first, used, work)
                first += BATCH * used
                filled = np.int64(0)
    if filled == 0:
        return
    for q in range(filled, BATCH):
        for a in range(width):
            work.batch[q, a] = 0.0
    _take(work.batch, work.moment, last)
    _project(batches, first, used, work)


@njit(**INLINED)
def _take_off(axis, m, filled, known, work):
    """Take what is known off a row of the batch, as ``identify.innovations`` says."""
    width, size = work.batch.shape[1], work.states.shape[0]
    if axis == 0:
        _carry(m, known, work)
    sigma, root = known.sigma[m], known.root[m, axis]
    for o in range(0, width, 8):
        new = load(work.batch, filled * width + o) * sigma
        for d in range(size):
            if known.seen[m, axis, d] != 0.0:
                new = new - load(work.states, d * width + o) * known.seen[m, axis, d]
        for d in range(size):
            state = load(work.states, d * width + o)
            store(work.states, d * width + o, state + new * known.gain[m, axis, d])
        store(work.batch, filled * width + o, new * (root / sigma))


@njit(**INLINED)
def _carry(m, known, work):
    """Carry what is known on to a sample from the one before."""
    width, places, by = work.batch.shape[1], known.places, known.carried
    for d in range(work.after.shape[0]):
        for a in range(width):
            work.after[d, a] = 0.0
    for k in range(places.shape[0]):
        to, of = places[k, 0] * width, places[k, 1] * width
        for o in range(0, width, 8):
            store(work.after, to + o, load(work.after, to + o) + load(work.states, of + o) * by[m, k])
    for d in range(work.after.shape[0]):
        for a in range(width):
            work.states[d, a] = work.after[d, a]


@njit(**INLINED)
def _take(batch, moment, last):
    """Add the products of the rows of a batch to the upper triangle of the moments."""
    width = batch.shape[1]
    for o in range(0, width, 8):
        a, b = load(batch, o), load(batch, width + o)
        c, d = load(batch, 2 * width + o), load(batch, 3 * width + o)
        e, f = load(batch, 4 * width + o), load(batch, 5 * width + o)
        g, h = load(batch, 6 * width + o), load(batch, 7 * width + o)
        for k in range(min(o + 8, last + 1)):
            one = a * take(batch, k) + b * take(batch, width + k)
            two = c * take(batch, 2 * width + k) + d * take(batch, 3 * width + k)
            one = one + e * take(batch, 4 * width + k) + f * take(batch, 5 * width + k)
            two = two + g * take(batch, 6 * width + k) + h * take(batch, 7 * width + k)
            store(moment, k * width + o, load(moment, k * width + o) + (one + two))
