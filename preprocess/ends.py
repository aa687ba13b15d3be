"""Outliers at the ends of stretches and beside gaps, where few samples speak for or against each other.

There a wild sample has neighbours on one side only, and two or three in a row support each other. All ways
to set some of the outermost samples aside are tried: the one that leaves the least misfit of the filter
counts, where the first sample set aside costs as much as the longest residual that a good one may have. For
one sample that is the rule of ``preprocess.gate``; for several it is their joint deletion residual. Wild
samples come in groups: each further one costs less.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from preprocess.chains import Assembled, Segments, inside
from preprocess.kalman import IntArray, Rows, misfit
from preprocess.trial import BoolArray, FloatArray

#: Outermost samples that are tried in all combinations.
OUTERMOST = 4
#: Samples on each side of them that they are compared with.
WITNESSES = 40
#: Share of good samples beside a wild one that may be set aside with it.
FALSE_ALARMS_BESIDE = 0.01
#: A gap is an interval of this many usual ones.
GAP = 3.5


def judge_ends(
    assembled: Assembled,
    segments: Segments,
    aside: BoolArray,
    variance: FloatArray,
    size_scale: FloatArray,
    q: float,
    prior: FloatArray,
    limit: float,
) -> BoolArray:
    """Return which samples are set aside, the outermost judged anew.

    Parameters
    ----------
    assembled : Assembled
    segments : tuple of (start, end)
    aside : (n,) bool
        Verdict so far.
    variance : (n,)
    size_scale : (n,)
        How much longer than they should be residuals are around each sample.
    q : float
    prior : (3,)
    limit : float
        Longest standardised residual of a good sample.
    """
    aside = aside.copy()
    rows = replace(assembled.rows, variance=variance)
    segment = inside(rows.t, segments)
    prices = _prices(limit, rows.value.shape[1])
    for k in range(int(assembled.stream.max(initial=-1)) + 1):
        mine = np.flatnonzero(assembled.stream == k)
        for low, high in outermost(rows.t[mine], segment[mine]):
            tried = mine[low:high]
            window = _window(mine, low, high, segment)
            scale = float(np.median(size_scale[tried])) ** 2
            aside[tried] = _cheapest(rows, window, tried, aside, q, prior, prices * scale)
    return aside


def _prices(limit: float, components: int) -> FloatArray:
    """Price of setting 0, 1, 2 … samples aside; (OUTERMOST + 1,)."""
    from scipy.special import chdtri

    further = float(chdtri(components, FALSE_ALARMS_BESIDE))
    return np.append(0.0, limit**2 + further * np.arange(OUTERMOST, dtype=float))


def outermost(t: FloatArray, segment: IntArray) -> list[tuple[int, int]]:
    """Ranges of the first and last samples of a stream beside gaps and ends of segments.

    Parameters
    ----------
    t : (n,) s
        Of one stream.
    segment : (n,)
        That each lies in.
    """
    if len(t) < 3 * OUTERMOST:
        return []
    step = np.diff(t)
    new = (step > GAP * np.median(step)) | (np.diff(segment) != 0)
    starts = np.r_[0, np.flatnonzero(new) + 1]
    ends = np.r_[starts[1:], len(t)]
    out = []
    for a, b in zip(starts.tolist(), ends.tolist(), strict=True):
        width = min(OUTERMOST, (b - a) // 2)
        out += [(a, a + width), (b - width, b)] if width else [(a, b)]
    return out


def _window(mine: IntArray, low: int, high: int, segment: IntArray) -> slice:
    """Return the rows of the samples' segment from some samples of the stream before them to some after."""
    first, last = mine[max(low - WITNESSES, 0)], mine[min(high + WITNESSES, len(mine)) - 1]
    start = np.searchsorted(segment, segment[mine[low]])
    end = np.searchsorted(segment, segment[mine[low]], side="right")
    return slice(int(max(first, start)), int(min(last + 1, end)))


def _cheapest(
    rows: Rows,
    window: slice,
    tried: IntArray,
    aside: BoolArray,
    q: float,
    prior: FloatArray,
    prices: FloatArray,
) -> BoolArray:
    """Return which of the tried samples to set aside for the least misfit and price."""
    part = Rows(*(getattr(rows, f)[window] for f in ("t", "order", "value", "variance", "fresh", "scale")))
    order = np.where(aside[window], -1, part.order)
    at = tried - window.start
    fresh = part.fresh.copy()
    fresh[0] = True
    ways = (np.arange(2 ** len(tried))[:, None] >> np.arange(len(tried))) & 1 == 1
    total = np.empty(len(ways))
    for k, way in enumerate(ways):
        used = order.copy()
        used[at] = np.where(way, -1, part.order[at])
        total[k] = misfit(replace(part, order=used, fresh=fresh), q, prior) + prices[way.sum()]
    return np.asarray(ways[int(np.argmin(total))])
