"""What a gyro's integral and a heading say of the same turns, piece by piece."""

from __future__ import annotations

import numpy as np

from preprocess.trial import BoolArray, FloatArray

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def turned_at(t: FloatArray, at: FloatArray, rate: FloatArray) -> FloatArray:
    """How far a gyro has turned (n,) at times ``t`` (n,), rad, whose yaw rate (m,) was logged ``at`` (m,)."""
    turned = np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(at)))
    return np.asarray(np.interp(t, at, turned), dtype=float)


def pieces(
    t: FloatArray, at: FloatArray, lasting: float, longest: float, samples: int
) -> tuple[IntArray, BoolArray]:
    """Places in ``t`` (n,) where pieces of about a length begin and end (k + 1,), and which of them (k,) both cover.

    A piece of more than the ``longest``, s, lacks headings, one with fewer ``samples`` of the gyro yaw rates.
    """
    wanted = np.arange(max(t[0], at[0]), min(t[-1], at[-1]), lasting)
    edges = np.unique(np.searchsorted(t, wanted))
    there = np.diff(np.searchsorted(at, t[edges])) >= samples
    return edges, there & (np.diff(t[edges]) < longest)
