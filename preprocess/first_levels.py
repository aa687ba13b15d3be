"""First guesses of a chain's noise levels, and the bounds within which they are estimated.

Two sensors of one motion that contradict each other slowly (a gyro whose scale is off, and a compass) are no case of
white noise, and the likelihood then likes to follow one of them exactly and to call the other one noisy. What each
sensor shows by itself bounds that from both sides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from preprocess.chains import Assembled, Segments, Stream, assemble
from preprocess.levels import FEW_ROWS, Levels, estimate_levels, thin_out
from preprocess.levels import MOST_ROWS as MOST_LEVEL_ROWS
from preprocess.trial import FloatArray

#: No sensor is better than this, in SI units: a micrometre, a microradian; nor a rate than this share of what it shows.
LEAST_NOISE, LEAST_SHARE = 1e-6, 1e-3
#: Share of the noise that a sensor shows alone which it keeps at least.
OWN_SHARE = 0.5
#: Rows on which a sensor is looked at by itself, at most.
MOST_ROWS = 4_000
#: A heading's white noise cannot be larger than what its neighbouring samples show, times this.
MOST_SHARE = 1.5


@dataclass(frozen=True)
class Bounds:
    """Least and greatest standard deviation of each stream's white noise, (g,) each."""

    least: FloatArray
    most: FloatArray


def rough_scale(stream: Stream) -> tuple[float, float]:
    """Robust standard deviation of second differences and typical rate of a stream, for first guesses."""
    v, t = stream.value[stream.good], stream.t[stream.good]
    if len(t) < 4:
        return 1.0, 1.0
    second = v[2:] - 2.0 * v[1:-1] + v[:-2]
    noise = 1.4826 * float(np.median(np.abs(second))) / np.sqrt(6.0)
    span = v[3:] - v[:-3]
    rate = float(np.percentile(np.abs(span) / (t[3:] - t[:-3])[:, None], 90.0))
    return max(noise, 1e-9), max(rate, 1e-6)


def first_guess(streams: tuple[Stream, ...]) -> tuple[Levels, FloatArray]:
    """Levels to start the search from, and the prior variances of a stretch."""
    scales = [rough_scale(s) for s in streams]
    rate = max(r for s, (_, r) in zip(streams, scales, strict=True) if s.order == 0)
    sigma = np.array([max(n, s.floor) for s, (n, _) in zip(streams, scales, strict=True)])
    given = np.array([s.sigma for s in streams])
    prior = np.array(
        [1e4 * (rate + 10.0 * sigma[0]) ** 2, 100.0 * (rate + sigma[0]) ** 2, 100.0 * (rate + sigma[0]) ** 2]
    )
    return Levels((0.1 * rate + 1e-6) ** 2, np.where(np.isfinite(given), given, sigma)), prior


def chain_levels(
    streams: tuple[Stream, ...],
    assembled: Assembled,
    start: Levels,
    prior: FloatArray,
    bounds: Bounds,
    near: bool = False,
    rough: bool = False,
) -> Levels:
    """Estimate the levels that are not given, within bounds.

    ``near``: the start is an estimate already; ``rough``: what is found is one more start only.
    """
    known = np.array([s.sigma for s in streams])
    rows, least, most = assembled.rows, bounds.least, bounds.most
    count = FEW_ROWS if rough else MOST_LEVEL_ROWS
    return estimate_levels(rows, assembled.stream, start, prior, known, least, near, most, count)


def own_noise(stream: Stream, segments: Segments) -> float:
    """Noise that a sensor shows by itself, without the others: a bound on what all together may claim.

    Of two estimates the lower: likelihood takes bursts of motion for noise where they are rare, differences of
    neighbours take any motion for noise where it is sampled slowly.
    """
    alone = (replace(stream, order=0),)
    start, prior = first_guess(alone)
    assembled = assemble(alone, segments, np.empty(0))
    rows, which = thin_out(assembled.rows, assembled.stream, MOST_ROWS)
    levels = estimate_levels(rows, which, start, prior, np.array([stream.sigma]), np.zeros(1))
    return min(float(levels.sigma[0]), rough_scale(stream)[0])


def bounds_of(streams: tuple[Stream, ...], segments: Segments) -> Bounds:
    """Bounds on the white noise of a chain's sensors.

    None is less than its rounding, nor, beside another sensor, than a part of what it shows alone. Of a heading beside
    a yaw rate, none is more than its neighbouring samples show: an angle that turns with the integral of the rate
    corrects that, so what contradicts between the two is counted as the rate's.
    """
    least = np.maximum([s.floor for s in streams], LEAST_NOISE)
    most = np.full(len(streams), np.inf)
    if len(streams) == 1:
        return Bounds(least, most)
    own = np.array([own_noise(s, segments) for s in streams])
    least = np.maximum(least, [_share_of_range(s) for s in streams])
    least = np.maximum(least, OWN_SHARE * own)
    if streams[0].value.shape[1] == 1:
        most[0] = MOST_SHARE * max(own[0], rough_scale(streams[0])[0], float(least[0]))
    return Bounds(least, most)


def _share_of_range(stream: Stream) -> float:
    if stream.order == 0 or not stream.good.any():
        return 0.0
    return LEAST_SHARE * float(np.sqrt(np.mean(stream.value[stream.good] ** 2)))
