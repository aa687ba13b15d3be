"""A position that wanders, taken off as it comes: what is new in each sample is white, compiled.

A satellite receiver's errors drift beside their white part (first-order Gauss-Markov). The smoother has told the drift
from the motion (``preprocess.wander``), whatever model there is. In every window a Kalman filter with the drift as its
state (Kalman 1960) predicts what of it each position shows; errors and tangents less that, over its standard
deviation, are white. It is the same for all of them, since its gains hang on times and sizes alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from identify.kernel import POSITION
from identify.simd import COMPILED

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


@dataclass(frozen=True)
class Drift:
    """Standard deviation of a drift, m, along each axis, and its time constant, s."""

    size: float
    time: float


class Gains(NamedTuple):
    """How the filter takes every sample of a stretch (m,); nothing where no drift is known.

    ``keep``: share of the drift that is left of the sample before; ``gain``: share of what is new that is drift;
    ``root``: the white part's σ over that of what is new; ``sigma``: of the white part.
    """

    keep: FloatArray
    gain: FloatArray
    root: FloatArray
    sigma: FloatArray


#: Where no drift is known.
NO_GAINS = Gains(*(np.zeros(0) for _ in range(4)))


def gains_of(
    drift: Drift | None, t: FloatArray, kind: IntArray, sigma: FloatArray, windows: Sequence[slice]
) -> Gains:
    """The filter's gains for samples (m,) of these times, kinds and σ; in each window it begins anew."""
    if drift is None:
        return NO_GAINS
    found = Gains(np.zeros(len(t)), np.zeros(len(t)), np.ones(len(t)), np.ascontiguousarray(sigma))
    places = np.array([(w.start, w.stop) for w in windows], dtype=np.int64).reshape(-1, 2)
    _gains(np.ascontiguousarray(t), kind, places, drift.size**2, drift.time, found)
    return found


def less_drift(gains: Gains, kind: IntArray, samples: slice, columns: FloatArray) -> FloatArray:
    """Columns (m, 2, k) of a window's samples, in units of their white part, made white."""
    if not len(gains.keep):
        return columns
    out = np.array(columns, dtype=float, order="C")
    drifted = np.zeros((2, out.shape[2]))
    _less(Gains(*(x[samples] for x in gains)), kind[samples], drifted, out)
    return out


@njit(**COMPILED)
def _gains(t, kind, places, variance, time, found):
    """Fill the gains of every window's positions."""
    for w in range(places.shape[0]):
        open_, before, begun = variance, 0.0, False
        for m in range(places[w, 0], places[w, 1]):
            if kind[m] != POSITION:
                continue
            if begun:
                kept = math.exp(-max(t[m] - before, 0.0) / time)
                open_ = kept * kept * open_ + (1.0 - kept * kept) * variance
                found.keep[m] = kept
            total = found.sigma[m] * found.sigma[m] + open_
            found.gain[m] = open_ / total
            found.root[m] = found.sigma[m] / math.sqrt(total)
            open_ *= 1.0 - found.gain[m]
            before, begun = t[m], True


@njit(**COMPILED)
def _less(gains, kind, drifted, columns):
    """Take the drift off the positions' rows, in place."""
    for m in range(columns.shape[0]):
        if kind[m] != POSITION:
            continue
        sigma, gain, root, keep = gains.sigma[m], gains.gain[m], gains.root[m], gains.keep[m]
        for axis in range(2):
            for k in range(columns.shape[2]):
                known = keep * drifted[axis, k]
                new = columns[m, axis, k] * sigma - known
                drifted[axis, k] = known + gain * new
                columns[m, axis, k] = new / sigma * root
