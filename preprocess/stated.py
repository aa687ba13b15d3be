"""What a sensor states of its own samples' accuracy (hAcc, sAcc, dilution), taken for as much as it is worth.

Only how the statements differ from sample to sample is used: the level of the noise is estimated as ever, so a
receiver that is too modest or too sure by a factor does no harm. Whether the statements are followed at all, in full
(σ as stated) or by half (σ as the square root of it), is decided by likelihood against noise that is alike for all
samples; a receiver whose word says nothing of its errors is not heard.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from preprocess.chains import Segments, Stream, assemble, at_levels
from preprocess.first_levels import first_guess
from preprocess.kalman import cost
from preprocess.levels import Levels, estimate_levels, thin_out
from preprocess.smoother import without_jumps
from preprocess.trial import BoolArray, FloatArray

#: Powers of the statement that are tried.
POWERS = (0.5, 1.0)
#: Gain in -2 log likelihood below which all samples are alike.
LEAST_GAIN = 12.0
#: Statements that differ by less than this factor (10th to 90th percentile) say nothing.
LEAST_SPREAD = 1.15
#: One sample counts at most so many times more or less than the usual one, in standard deviations.
MOST_RATIO = 30.0
#: Rows on which it is tried at most, and samples that are needed.
MOST_ROWS, LEAST_SAMPLES = 3_000, 40


@dataclass(frozen=True)
class Word:
    """What came of a sensor's word.

    Attributes
    ----------
    power : float
        The samples' standard deviations are as the statement to this power; 0: not heard.
    gain : float
        In -2 log likelihood, of the best power against none.
    usual : float
        Median of what it states of its good samples.
    """

    power: float
    gain: float
    usual: float


def relative(stated: FloatArray, good: BoolArray) -> FloatArray | None:
    """Statements over their median, (n,); None where they are missing or all alike."""
    known = stated[good & np.isfinite(stated) & (stated > 0.0)]
    if len(known) < LEAST_SAMPLES:
        return None
    low, usual, high = np.percentile(known, [10.0, 50.0, 90.0])
    if high < LEAST_SPREAD * low and not (np.abs(np.log(known / usual)) > np.log(2.0)).mean() > 0.01:
        return None
    ratio = np.where(np.isfinite(stated) & (stated > 0.0), stated, usual) / usual
    return np.asarray(np.clip(ratio, 1.0 / MOST_RATIO, MOST_RATIO), float)


def weights(ratio: FloatArray, power: float, good: BoolArray) -> FloatArray:
    """Variance of each sample as a multiple of the stream's, (n,): one on average over the good ones."""
    weight = ratio ** (2.0 * power)
    return np.asarray(weight / weight[good].mean(), float)


def heard(stream: Stream, stated: FloatArray | None, segments: Segments) -> tuple[Stream, Word | None]:
    """Return the stream with its samples weighted by what the sensor states, where that makes them likelier.

    Parameters
    ----------
    stream : Stream
    stated : (n,), optional
        What the sensor states of each sample, to a factor.
    segments : tuple of (start, end)

    Returns
    -------
    stream : Stream
    word : Word or None
        None where it states nothing, or the same of all samples.
    """
    ratio = None if stated is None else relative(stated, stream.good)
    if stated is None or ratio is None:
        return stream, None
    alone = replace(without_jumps(stream), order=0)
    alike = _deviance(alone, segments)
    tried = {p: replace(alone, weight=weights(ratio, p, alone.good)) for p in POWERS}
    gains = {p: alike - _deviance(s, segments) for p, s in tried.items()}
    power = max(gains, key=lambda p: gains[p])
    usual = float(np.nanmedian(stated[stream.good]))
    if not gains[power] > LEAST_GAIN:
        return stream, Word(0.0, gains[power], usual)
    return replace(stream, weight=tried[power].weight), Word(power, gains[power], usual)


def all_heard(
    streams: tuple[Stream, ...], stated: Mapping[str, FloatArray | None], segments: Segments
) -> tuple[tuple[Stream, ...], dict[str, Word]]:
    """:func:`heard` for the streams of a chain, each by itself; the words by stream, of those that say something."""
    both = [heard(s, stated.get(s.name), segments) for s in streams]
    words = {s.name: w for s, w in both if w is not None}
    return tuple(s for s, _ in both), words


def _deviance(stream: Stream, segments: Segments) -> float:
    """-2 log likelihood of a stream by itself, over its noise and the intensity of its motion."""
    assembled = assemble((stream,), segments, np.empty(0))
    rows, which = thin_out(assembled.rows, assembled.stream, MOST_ROWS)
    start, prior = first_guess((stream,))
    known, least = np.array([np.nan]), np.array([max(stream.floor, 1e-9)])
    found: Levels = estimate_levels(rows, which, start, prior, known, least)
    thin = replace(assembled, rows=rows, stream=which)
    return cost(at_levels(thin, found.sigma), found.q, prior)
