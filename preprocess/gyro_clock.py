"""Offset between the clocks of heading and yaw rate: by the likelihood of their chain with stamps moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from preprocess.chains import Segments, Stream, assemble, at_levels, inside
from preprocess.first_levels import first_guess
from preprocess.intensity import fitted_intensity
from preprocess.kalman import Rows, cost
from preprocess.levels import BLOCKS, MOST_ROWS
from preprocess.offsets import LONGEST, WORST, ClockOffset, search
from preprocess.smoother import ChainResult
from preprocess.trial import FloatArray

#: Samples of the yaw rate that are needed.
LEAST_SAMPLES = 20


def yaw_rate_offset(heading: ChainResult, segments: Segments) -> ClockOffset | None:
    """Offset of the yaw rate's stamps against the heading's, by likelihood.

    None without a yaw rate, or where nothing can be known: too few samples, or a turn too even for its moment
    to be told.
    """
    names = [s.name for s in heading.streams]
    if names != ["heading", "yaw_rate"] or not segments:
        return None
    parts = excerpts(heading.streams, segments)
    compass, gyro = heading.streams[0], well_inside(heading.streams[1], parts)
    if int(gyro.good.sum()) < LEAST_SAMPLES:
        return None
    guess, prior = first_guess(tuple(replace(s, sigma=float("nan")) for s in heading.streams))
    # an offset makes one of the two seem noisy: neither is noisier than it is by itself
    sigma = np.minimum(heading.levels.sigma, guess.sigma)

    def rows(tau: float) -> Rows:
        return _rows((compass, replace(gyro, t=gyro.t - tau)), sigma, parts)

    first = fitted_intensity(rows(0.0), guess.q, prior)
    near, _ = search(lambda tau: cost(rows(tau), first, prior))
    q = fitted_intensity(rows(near), first, prior)

    def deviance(tau: float) -> float:
        return cost(rows(tau), q, prior)

    offset, curvature = search(deviance, 0.25 * LONGEST, near)
    if curvature <= 0.0 or abs(offset) > 0.9 * LONGEST:
        return None
    # -2 log L has curvature 2 / variance; far from a parabola, what was gained says how sure it is
    gained = max(deviance(0.0) - deviance(offset), 1e-12)
    bounds = (
        np.sqrt(2.0 / curvature),
        abs(offset) / np.sqrt(gained),
        least_error(heading, gyro, float(sigma[1])),
    )
    stderr = float(max(bounds))
    return None if stderr > WORST else ClockOffset("yaw_rate", "heading", offset, stderr)


def excerpts(streams: tuple[Stream, ...], segments: Segments) -> Segments:
    """Return the segments; of long ones only even parts, so that ``MOST_ROWS`` samples or so are in them."""
    total = sum(int((s.good & (inside(s.t, segments) >= 0)).sum()) for s in streams)
    if total <= MOST_ROWS:
        return segments
    share = MOST_ROWS / total
    length = share * sum(b - a for a, b in segments) / BLOCKS
    out: list[tuple[float, float]] = []
    for a, b in segments:
        count = max(int(np.ceil(share * (b - a) / length - 1e-9)), 1)
        starts = np.linspace(a, max(b - length, a), count)
        out += [(float(x), float(min(x + length, b))) for x in starts]
    return tuple(out)


def well_inside(stream: Stream, segments: Segments) -> Stream:
    """The stream with only those samples in use that no offset moves out of their segment.

    Were some lost or won as the stamps move, their number would decide.
    """
    reach = 1.5 * LONGEST
    inner = tuple((a + reach, b - reach) for a, b in segments if b - a > 2.0 * reach)
    return replace(stream, good=stream.good & (inside(stream.t, inner) >= 0))


def least_error(heading: ChainResult, gyro: Stream, sigma: float) -> float:
    """Standard error that an offset has at least: an even turn says nothing of its moment, s."""
    known = np.isfinite(heading.mean[:, 2, 0])
    if not known.any():
        return float("inf")
    power = np.maximum(heading.mean[known, 2, 0] ** 2 - heading.covariance[known, 2, 2], 0.0)
    at = np.interp(gyro.t[gyro.good], heading.t[known], power)
    return float(sigma / np.sqrt(max(at.sum(), 1e-300)))


def _rows(streams: tuple[Stream, ...], sigma: FloatArray, segments: Segments) -> Rows:
    """Rows of an even drive: one that follows the inputs is itself a statement about time."""
    return at_levels(assemble(streams, segments, np.empty(0)), sigma)
