"""Pieces of a log over which a gyro and a heading say how far the vessel turned."""

from __future__ import annotations

import numpy as np

from preprocess.trial import BoolArray, FloatArray

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


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
