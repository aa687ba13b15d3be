"""Outliers of a chain: each sample against what all other samples of all sensors say of it.

The deletion residual (de Jong and Penzer 1998) is the difference between a sample and the smoother run
without it; its variance is known exactly, including that of the motion between samples, so the rule holds
at any rate and in hard manoeuvres. Only the worst of neighbours is set aside in one pass, as an outlier
also spoils the residuals around it; samples that were set aside are tried again against the cleaned
motion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from preprocess.chains import Assembled, Drive, Segments, Stream, assemble, at_levels
from preprocess.ends import judge_ends
from preprocess.kalman import UNMEASURED, smooth
from preprocess.levels import Levels
from preprocess.trial import BoolArray, FloatArray

#: Share of good samples that may be set aside.
FALSE_ALARMS = 1e-3
PASSES = 8
#: Share of samples whose verdict may still change when the passes end.
NEGLIGIBLE = 2e-4
#: The median of a window of 31 residuals comes out so much larger by chance and by single outliers.
CHANCE = 1.25
#: Samples on each side that an outlier can spoil.
REACH = 3


def threshold(components: int) -> float:
    """Length of a standardised residual that only ``FALSE_ALARMS`` of good samples exceed."""
    from scipy.special import chdtri

    return float(np.sqrt(chdtri(components, FALSE_ALARMS)))


def truncation(components: int) -> float:
    """Return what is left of a standard deviation when the tails beyond the threshold are cut off."""
    from scipy.special import chdtr

    limit = threshold(components) ** 2
    return float(np.sqrt(chdtr(components + 2, limit) / chdtr(components, limit)))


def gate(
    streams: tuple[Stream, ...],
    segments: Segments,
    levels: Levels,
    prior: FloatArray,
    drive: Drive | None = None,
) -> tuple[Stream, ...]:
    """Return the streams with outliers set aside.

    Parameters
    ----------
    streams : tuple of Stream
        ``candidate`` samples are tested; what is not good there stays out.
    segments : tuple of (start, end)
    levels : Levels
    prior : (3,)
    """
    everything = tuple(replace(s, good=s.candidate) for s in streams)
    assembled = assemble(everything, segments, np.empty(0), drive)
    aside = _initially_aside(streams, assembled)
    limit = threshold(streams[0].value.shape[1])
    for _ in range(PASSES):
        size = residual_size(assembled, aside, levels, prior)
        scale = local_scale(size, assembled)
        size = size / scale
        worst = size >= _most_around(size, assembled, aside)
        new = np.where(aside, size > limit, (size > limit) & worst)
        settled = int((new != aside).sum()) <= NEGLIGIBLE * len(aside)
        aside = new
        if settled:
            break
    variance = at_levels(assembled, levels.sigma).variance
    aside = judge_ends(assembled, segments, aside, variance, scale, levels.q, prior, limit)
    return tuple(_with_good(s, k, assembled, aside) for k, s in enumerate(streams))


def _initially_aside(streams: tuple[Stream, ...], assembled: Assembled) -> BoolArray:
    aside = np.zeros(len(assembled.stream), dtype=bool)
    for k, s in enumerate(streams):
        mine = assembled.stream == k
        aside[mine] = ~s.good[assembled.sample[mine]]
    return aside


def residual_size(assembled: Assembled, aside: BoolArray, levels: Levels, prior: FloatArray) -> FloatArray:
    """Length of the standardised difference between each sample and the smoother without it; (n,)."""
    rows = at_levels(assembled, levels.sigma)
    used, variance = replace(rows, order=np.where(aside, -1, rows.order)), rows.variance
    out = smooth(used, levels.q, prior, UNMEASURED)
    at = np.arange(len(rows.t)), np.maximum(rows.order, 0)
    outside = rows.value - out.mean[at]
    outside_variance = variance + np.maximum(out.covariance[at[0], at[1], at[1]], 0.0)
    error = np.where(aside[:, None], outside, out.deletion)
    error_variance = np.where(aside, outside_variance, np.maximum(out.deletion_variance, variance))
    return np.asarray(np.sqrt((error**2).sum(axis=1) / error_variance))


def local_scale(size: FloatArray, assembled: Assembled, width: int = 31) -> FloatArray:
    """How much larger residuals are than they should be around each sample (1 at least), by stream; (n,).

    A manoeuvre that is harder than the rest of the log makes all residuals larger for a while: none is an outlier. The
    median over a window tells, what was set aside included; less its standard error, or it would be chance that hides
    outliers.
    """
    from scipy.ndimage import median_filter
    from scipy.special import chdtri

    usual = np.sqrt(chdtri(assembled.rows.value.shape[1], 0.5)) * CHANCE
    out = np.ones(len(size))
    for k in range(int(assembled.stream.max(initial=-1)) + 1):
        mine = np.flatnonzero(assembled.stream == k)
        if len(mine) >= width:
            out[mine] = np.maximum(median_filter(size[mine], size=width, mode="mirror") / usual, 1.0)
    return out


def _most_around(size: FloatArray, assembled: Assembled, aside: BoolArray) -> FloatArray:
    """Largest residual among the samples in use around each, by stream; (n,)."""
    from scipy.ndimage import maximum_filter1d

    out = np.zeros(len(size))
    for k in range(int(assembled.stream.max(initial=-1)) + 1):
        mine = np.flatnonzero((assembled.stream == k) & ~aside)
        if len(mine):
            out[mine] = maximum_filter1d(size[mine], size=2 * REACH + 1, mode="nearest")
    return out


def _with_good(s: Stream, k: int, assembled: Assembled, aside: BoolArray) -> Stream:
    good = s.candidate.copy()
    mine = assembled.stream == k
    good[assembled.sample[mine]] = ~aside[mine]
    return replace(s, good=good, judged=True)
