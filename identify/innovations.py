"""What is new in each sample where something known moves the errors: a Kalman filter's innovations, compiled.

A receiver's drift (``identify.drift``) and waves (``identify.swell``) are states of a linear process that white noise
drives. In every window a filter with these states (Kalman 1960) predicts what of them each row shows; errors and
tangents less that, over its standard deviation, are white. It is the same for all of them, since its gains hang on
times, sizes and headings alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.linalg import block_diag

from identify.simd import COMPILED, WIDTH, load, splat, store

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


class Process(NamedTuple):
    """What moves errors, with D states, at samples (m,); every quantity in the errors' own units.

    ``places`` (K, 2): to which state each of ``carried`` (m, K) carries and from which, since the sample before;
    ``noise_places`` (N, 2), the first no larger: which covariances the ``noise`` (m, N) of that time has; ``seen``
    (m, 2, D): what of each state a row shows; ``begin`` (D, D): covariance as a window begins.
    """

    places: IntArray
    carried: FloatArray
    noise_places: IntArray
    noise: FloatArray
    seen: FloatArray
    begin: FloatArray


class Filter(NamedTuple):
    """How the rows (m, 2) of a stretch are made new: ``places``, ``carried`` and ``seen`` as in ``Process``.

    ``gain`` (m, 2, D): share of what is new that is each state's; ``root`` (m, 2): σ of the white part over that of
    what is new; ``sigma`` (m,): of the white part; ``used`` (m,): which samples show anything.
    """

    places: IntArray
    carried: FloatArray
    seen: FloatArray
    gain: FloatArray
    root: FloatArray
    sigma: FloatArray
    used: BoolArray

    @property
    def states(self) -> int:
        """How many states there are: none where nothing moves the errors."""
        return self.seen.shape[2]

    def information(self, samples: slice) -> float:
        """Log determinant of the covariance of a window's rows over that of their white parts."""
        return float(-2.0 * np.log(self.root[samples]).sum()) if self.states else 0.0


#: Where nothing is known to move the errors.
NO_FILTER = Filter(
    np.zeros((0, 2), dtype=np.int64), np.zeros((0, 0)), np.zeros((0, 2, 0)), np.zeros((0, 2, 0)), np.zeros((0, 2)),
    np.zeros(0), np.zeros(0, dtype=bool),
)  # fmt: skip


def since_used(t: FloatArray, used: BoolArray) -> FloatArray:
    """Time (m,) of every sample since the one before that is used, s."""
    since = np.zeros(len(t))
    since[used] = np.maximum(np.diff(t[used], prepend=t[used][:1]), 0.0)
    return since


def together(parts: Sequence[Process]) -> Process:
    """Processes that know nothing of each other, as one."""
    first = np.cumsum([0, *(p.begin.shape[0] for p in parts)])
    seen = np.zeros((*parts[0].seen.shape[:2], first[-1]))
    for p, k in zip(parts, first[:-1], strict=True):
        seen[:, :, k : k + p.begin.shape[0]] = p.seen
    return Process(
        np.concatenate([p.places + k for p, k in zip(parts, first[:-1], strict=True)]),
        np.concatenate([p.carried for p in parts], axis=1),
        np.concatenate([p.noise_places + k for p, k in zip(parts, first[:-1], strict=True)]),
        np.concatenate([p.noise for p in parts], axis=1), seen, block_diag(*(p.begin for p in parts)),
    )  # fmt: skip


def filter_of(process: Process, sigma: FloatArray, used: BoolArray, windows: Sequence[slice]) -> Filter:
    """The filter for samples (m,) of which the white parts have these σ; in each window it begins anew."""
    shape = process.seen.shape
    found = Filter(
        process.places, np.ascontiguousarray(process.carried), process.seen, np.zeros(shape), np.ones(shape[:2]),
        np.ascontiguousarray(sigma), used,
    )  # fmt: skip
    edges = np.array([(w.start, w.stop) for w in windows], dtype=np.int64).reshape(-1, 2)
    size = shape[2]
    every = np.repeat(np.array(process.begin)[None], len(edges), axis=0)
    _fill(process, edges, found, every, np.zeros((size, size)), np.zeros(size))
    return found


def new_in(known: Filter, samples: slice, columns: FloatArray) -> FloatArray:
    """Columns (m, 2, k) of a window's samples, in units of their white part, made white."""
    if not known.states:
        return columns
    size = columns.shape[2]
    out = np.zeros((*columns.shape[:2], size + -size % WIDTH))
    out[:, :, :size] = columns
    states, after = np.zeros((2, known.states, out.shape[2]))
    _take_off(known, samples.start, states, after, out)
    return np.ascontiguousarray(out[:, :, :size])


@njit(**COMPILED)
def _fill(process, edges, found, every, work, shown):
    """Fill gains and roots; ``every`` (w, D, D) is covariance, ``work`` and ``shown`` places to work in."""
    places, noise_places = process.places, process.noise_places
    for w in range(edges.shape[0]):
        p, begun = every[w], False
        for m in range(edges[w, 0], edges[w, 1]):
            if not found.used[m]:
                continue
            if begun:
                _carry(places, process.carried, m, p, work)
                for n in range(noise_places.shape[0]):
                    i, j = noise_places[n, 0], noise_places[n, 1]
                    p[i, j] += process.noise[m, n]
                    if i != j:
                        p[j, i] += process.noise[m, n]
            begun = True
            for axis in range(2):
                _update(process.seen, m, axis, p, shown, found)


@njit(**COMPILED)
def _carry(places, carried, m, p, work):
    """Carry a covariance (D, D) on to the next sample."""
    size = p.shape[0]
    for i in range(size):
        for j in range(size):
            work[i, j] = 0.0
    for k in range(places.shape[0]):
        to, of, by = places[k, 0], places[k, 1], carried[m, k]
        for j in range(size):
            work[to, j] += by * p[of, j]
    for i in range(size):
        for j in range(size):
            p[i, j] = 0.0
    for k in range(places.shape[0]):
        to, of, by = places[k, 0], places[k, 1], carried[m, k]
        for i in range(size):
            p[i, to] += by * work[i, of]


@njit(**COMPILED)
def _update(seen, m, axis, p, shown, found):
    """Gain of one row, and the covariance (D, D) after it."""
    size, total = p.shape[0], 0.0
    for i in range(size):
        shown[i] = 0.0
    for j in range(size):
        if seen[m, axis, j] != 0.0:
            for i in range(size):
                shown[i] += p[j, i] * seen[m, axis, j]
    for i in range(size):
        total += seen[m, axis, i] * shown[i]
    if not total > 0.0:
        return
    total += found.sigma[m] * found.sigma[m]
    spread = np.sqrt(total)
    found.root[m, axis] = found.sigma[m] / spread
    for i in range(size):
        found.gain[m, axis, i] = shown[i] / total
        shown[i] /= spread
    for i in range(size):
        for j in range(size):
            p[i, j] -= shown[i] * shown[j]


@njit(**COMPILED)
def _take_off(known, first, states, after, columns):
    """Take what is known off a window's rows (m, 2, k), in place; ``identify.measure`` does so to rows as they come."""
    places, size, width = known.places, states.shape[0], states.shape[1]
    for q in range(columns.shape[0]):
        m = first + q
        if not known.used[m]:
            continue
        for c in range(0, size * width, WIDTH):
            store(after, c, splat(0.0))
        for k in range(places.shape[0]):
            to, of, by = places[k, 0] * width, places[k, 1] * width, known.carried[m, k]
            for c in range(0, width, WIDTH):
                store(after, to + c, load(after, to + c) + load(states, of + c) * by)
        for axis in range(2):
            for c in range(0, width, WIDTH):
                at = (q * 2 + axis) * width + c
                new = load(columns, at) * known.sigma[m]
                for d in range(size):
                    if known.seen[m, axis, d] != 0.0:
                        new = new - load(after, d * width + c) * known.seen[m, axis, d]
                for d in range(size):
                    state = load(after, d * width + c) + new * known.gain[m, axis, d]
                    store(after, d * width + c, state)
                store(columns, at, new * (known.root[m, axis] / known.sigma[m]))
        states, after = after, states
