"""What a sensor shows less the integral of what another says of its rate: no motion is in it, only what is wrong.

A heading and a gyro, or a position and a velocity along one axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from preprocess.trial import FloatArray, Measurement

#: Fewer blocks than this in a piece say nothing of it, nor do fewer samples of the rate.
LEAST = 6
#: A sensor of a rate that is silent for longer than so many of its intervals, and than this, s, begins anew.
SILENT, SILENT_SECONDS = 5.0, 1.0
#: The rate and its slope are taken over so long, s, each way: about as long as one sensor may be late.
LATE = 0.5
#: A sensor of less noise than this, SI, is as good as exact; share of the largest information below which nothing is
#: told.
EXACT, UNTOLD = 1e-6, 1e-9
#: Shortest of the long blocks over which errors are averaged, s, and about how many there are in all.
SHORTEST, MOST = 1.0, 500


class Sensed(NamedTuple):
    """The good samples of a sensor: times (n,), values (n,), white noise."""

    t: FloatArray
    value: FloatArray
    sigma: float

    @property
    def every(self) -> float:
        """Usual time between two samples, s."""
        return float(np.median(np.diff(self.t))) if len(self.t) > 1 else np.inf

    @property
    def missed(self) -> float:
        """How much faster than its white noise a rate's errors may add up, as a logarithm: by what it bends unseen.

        Straight lines between samples leave out a twelfth of the second difference times the interval.
        """
        bend = np.diff(self.value, 2)
        noise = 144.0 * max(self.sigma, EXACT) ** 2
        return 0.5 * float(np.log1p(np.mean(bend**2) / noise)) if len(bend) else 0.0


def sensed(measurement: Measurement, axis: int | None = None) -> Sensed:
    """The good samples of a measurement, along one axis of two."""
    good = measurement.good
    value = measurement.value[good] if axis is None else measurement.value[good, axis]
    return Sensed(measurement.t[good], value, measurement.sigma)


class Run(NamedTuple):
    """Times (n,) of a ``value`` that a rate spans, the rate's ``integral`` at them, the rate itself and its slope.

    ``walk`` is the variance that the rate's own white noise adds up to in a second, in units of the value's.
    """

    log: int
    at: FloatArray
    value: FloatArray
    integral: FloatArray
    rate: FloatArray
    slope: FloatArray
    walk: float

    def over(self, part: slice) -> Run:
        """Part of the run."""
        at, value, integral = self.at[part], self.value[part], self.integral[part]
        return Run(self.log, at, value, integral, self.rate[part], self.slope[part], self.walk)


class Piece(NamedTuple):
    """Averages over blocks of a ``length``, s.

    ``t`` (b,), ``value`` (b,) less the integral, ``columns`` (b, k), ``samples`` (b,); ``walk`` as of a run.
    """

    log: int
    t: FloatArray
    value: FloatArray
    columns: FloatArray
    samples: FloatArray
    walk: float
    length: float


def runs_of(log: int, value: Sensed, rate: Sensed, segments: Sequence[tuple[float, float]]) -> list[Run]:
    """What of a log a rate spans that is never silent for long."""
    if len(rate.t) < LEAST:
        return []
    longest = max(SILENT * rate.every, SILENT_SECONDS)
    edges = [0, *(np.nonzero(np.diff(rate.t) > longest)[0] + 1), len(rate.t)]
    found = [
        _run(log, value, Sensed(rate.t[a:b], rate.value[a:b], rate.sigma), span)
        for a, b in pairwise(edges) for span in segments if b - a >= LEAST
    ]  # fmt: skip
    return [run for run in found if len(run.at) >= LEAST]


def _run(log: int, value: Sensed, rate: Sensed, span: tuple[float, float]) -> Run:
    t, r = rate.t, rate.value
    inside = (value.t >= max(t[0], span[0])) & (value.t <= min(t[-1], span[1]))
    at = value.t[inside]
    walk = rate.every * (rate.sigma / max(value.sigma, EXACT)) ** 2
    before, now, after = (integral_at(at + shift, t, r) for shift in (-LATE, 0.0, LATE))
    speed, slope = 0.5 * (after - before) / LATE, (after - 2.0 * now + before) / LATE**2
    return Run(log, at, value.value[inside], now, speed, slope, walk)


def integral_at(t: FloatArray, at: FloatArray, rate: FloatArray) -> FloatArray:
    """What a rate (m,) that was logged ``at`` times (m,) has added up to at times ``t`` (n,), since the first."""
    added = np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(at)))
    return np.asarray(np.interp(t, at, added), dtype=float)


def piece_of(run: Run, columns: FloatArray, length: float) -> Piece | None:
    """What is left of value and integral, and columns (n, k), in blocks of about ``length`` s; None of too few."""
    _, where, count = np.unique((run.at - run.at[0]) // length, return_inverse=True, return_counts=True)
    if len(count) < LEAST:
        return None
    mean = [np.bincount(where, c) / count for c in (run.at, run.value - run.integral, *columns.T)]
    return Piece(run.log, mean[0], mean[1], np.column_stack(mean[2:]), count.astype(float), run.walk, length)


def with_own(piece: Piece, logs: int) -> Piece:
    """The piece with a constant error of the rate in its own log alone."""
    offset = np.zeros((len(piece.t), logs))
    offset[:, piece.log] = piece.t - piece.t.mean()
    return piece._replace(columns=np.column_stack([piece.columns, offset]))


def in_long_blocks(runs: Sequence[Run], columns: Sequence[FloatArray], logs: int) -> list[Piece]:
    """Whole runs, with what stands beside them (n, k), in long blocks."""
    length = max(SHORTEST, sum(run.at[-1] - run.at[0] for run in runs) / MOST)
    each = [piece_of(run, c, length) for run, c in zip(runs, columns, strict=True)]
    return [with_own(p, logs) for p in each if p]
