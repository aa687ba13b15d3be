"""The part of a track that its turning explains: taken off before the track is smoothed, added again after.

A vessel that turns carries its velocity round with it. In earth axes that is an acceleration, ``r`` times the velocity
at right angles to it, far larger than those along the body's axes; but it needs no guessing, because the yaw rate and
(from a first pass) the velocity are known. What is left of the track without it is as smooth as the body's own
accelerations.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from preprocess.chains import Segments, Stream
from preprocess.driven import with_verdicts
from preprocess.known_motion import KnownMotion, explains, less, plus
from preprocess.smoother import ChainResult, smooth_chain
from preprocess.trial import FloatArray, Measurement
from preprocess.wander import allow_for_wander


def smooth_track(
    streams: tuple[Stream, ...],
    heading: ChainResult,
    segments: Segments,
    wanted: FloatArray,
    inputs: Mapping[str, Measurement],
    beside: Segments,
) -> ChainResult:
    """Smooth positions and velocities, the motion that turning explains apart; see ``smooth_chain``."""
    first = smooth_chain(streams, segments, wanted, inputs, beside=beside, rounds=1)
    turned, cleaned = turned_track(first, heading), with_verdicts(streams, first)
    if turned is None or not explains(cleaned, turned, first.levels, segments):
        return allow_for_wander(smooth_chain(cleaned, segments, wanted, inputs, beside=beside), segments)
    rest = smooth_chain(less(cleaned, turned), segments, wanted, inputs, beside=beside)
    return plus(allow_for_wander(rest, segments), turned, streams)


def turned_track(track: ChainResult, heading: ChainResult) -> KnownMotion | None:
    """Motion from the centripetal acceleration of a first pass; None where nothing was smoothed.

    Parameters
    ----------
    track, heading : ChainResult
        At the same times.
    """
    known = _known(track, heading)
    if known.sum() < 3:
        return None
    velocity, r = track.mean[known, 1, :], heading.mean[known, 1, 0]
    return accelerated(track.t[known], r[:, None] * np.column_stack([-velocity[:, 1], velocity[:, 0]]))


def _known(track: ChainResult, heading: ChainResult) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    return np.asarray(np.isfinite(track.mean[:, 1, 0]) & np.isfinite(heading.mean[:, 1, 0]))


def accelerated(t: FloatArray, acceleration: FloatArray) -> KnownMotion:
    """Motion from rest under an acceleration (n, 2) that is straight between its times."""
    dt = np.diff(t)[:, None]
    before, after = acceleration[:-1], acceleration[1:]
    rate = _summed(0.5 * dt * (before + after))
    position = _summed(dt * rate[:-1] + dt**2 * (2.0 * before + after) / 6.0)
    return KnownMotion(t, np.stack([position, rate, acceleration]))


def _summed(steps: FloatArray) -> FloatArray:
    return np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
