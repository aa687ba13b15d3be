"""The sensors of one chain (north and east, or heading) as rows for the filter."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from preprocess.kalman import IntArray, Rows
from preprocess.trial import BoolArray, FloatArray

Segments = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Stream:
    """One sensor of a chain.

    Attributes
    ----------
    name : str
    t : (n,) s
        Strictly increasing.
    value : (n, m)
    order : int
        0: it measures the position of the chain, 1: its rate.
    sigma : float
        Given or estimated standard deviation; NaN where not known yet.
    good : (n,) bool
        In use.
    candidate : (n,) bool
        May come into use: not flagged, not repeated.
    floor : float
        Standard deviation below which its noise cannot lie: that of its rounding.
    judged : bool
        Its samples were held against the motion before.
    weight : (n,), optional
        Variance of each sample as a multiple of the stream's; None: all alike.
    """

    name: str
    t: FloatArray
    value: FloatArray
    order: int
    good: BoolArray
    candidate: BoolArray
    sigma: float = float("nan")
    floor: float = 0.0
    judged: bool = False
    weight: FloatArray | None = None


def inside(t: FloatArray, segments: Segments) -> IntArray:
    """Which segment each time lies in, -1 where in none; (n,) int64."""
    if not segments:
        return np.full(len(t), -1, dtype=np.int64)
    starts, ends = np.array(segments).T
    at = np.searchsorted(starts, t, side="right") - 1
    return np.where((at >= 0) & (t <= ends[at]), at, -1).astype(np.int64)


@dataclass(frozen=True)
class Drive:
    """How the process intensity varies over time: (n,) s, and (n,) natural logarithm of its factor."""

    t: FloatArray
    log_scale: FloatArray


@dataclass(frozen=True)
class Assembled:
    """Rows with what they came from: ``stream`` and ``sample`` index, -1 where nothing was measured.

    The rows' variance is the weight of their sample until levels are given (:func:`at_levels`).
    """

    rows: Rows
    stream: IntArray
    sample: IntArray


def assemble(
    streams: tuple[Stream, ...], segments: Segments, wanted: FloatArray, drive: Drive | None = None
) -> Assembled:
    """Rows of all good samples inside the segments, and a blank row at each wanted time without one.

    Parameters
    ----------
    streams : tuple of Stream
        All with the same number of components.
    segments : tuple of (start, end)
    wanted : (k,) s
        Sorted times at which the state is wanted.
    drive : Drive, optional
        How hard the vessel is driven over time; None: evenly.
    """
    used = [np.flatnonzero(s.good & (inside(s.t, segments) >= 0)) for s in streams]
    times = [s.t[i] for s, i in zip(streams, used, strict=True)]
    blank = _without(wanted[inside(wanted, segments) >= 0], times)
    t = np.concatenate([*times, blank])
    stream = np.concatenate([*(np.full(len(i), k) for k, i in enumerate(used)), np.full(len(blank), -1)])
    sample = np.concatenate([*used, np.full(len(blank), -1)])
    width = streams[0].value.shape[1]
    value = np.concatenate(
        [*(s.value[i] for s, i in zip(streams, used, strict=True)), np.zeros((len(blank), width))]
    )
    weight = [
        np.ones(len(i)) if s.weight is None else s.weight[i] for s, i in zip(streams, used, strict=True)
    ]
    order = np.append([s.order for s in streams], -1)[stream]
    at = np.argsort(t, kind="stable")  # of sorted pieces: one pass over them
    rows = Rows(
        t[at],
        order[at].astype(np.int64),
        value[at],
        np.concatenate([*weight, np.ones(len(blank))])[at],
        _fresh(t[at], segments),
        _scale(drive, t[at]),
    )
    return Assembled(rows, stream[at].astype(np.int64), sample[at].astype(np.int64))


def _without(wanted: FloatArray, times: list[FloatArray]) -> FloatArray:
    """Distinct times of the sorted ones that are in none of the sorted others."""
    new = np.ones(len(wanted), dtype=bool)
    new[1:] = np.diff(wanted) > 0.0
    for t in times:
        if len(t):
            at = np.minimum(np.searchsorted(t, wanted), len(t) - 1)
            new &= t[at] != wanted
    return wanted[new]


def _scale(drive: Drive | None, t: FloatArray) -> FloatArray:
    if drive is None or not len(drive.t):
        return np.ones(len(t))
    return np.exp(np.interp(t, drive.t, drive.log_scale))


def _fresh(t: FloatArray, segments: Segments) -> BoolArray:
    segment = inside(t, segments)
    fresh = np.ones(len(t), dtype=bool)
    fresh[1:] = np.diff(segment) != 0
    return fresh


def variances(stream: IntArray, sigma: FloatArray) -> FloatArray:
    """Variance of each row from the standard deviation of its stream (1 for blank rows)."""
    return np.asarray(np.append(sigma, 1.0)[stream] ** 2, float)


def at_levels(assembled: Assembled, sigma: FloatArray) -> Rows:
    """Rows with their variance, from the standard deviation of their stream and the weight of their sample."""
    return replace(assembled.rows, variance=variances(assembled.stream, sigma) * assembled.rows.variance)
