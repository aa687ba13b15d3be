"""The part of a track that its turning explains: taken off before the track is smoothed, added again after.

A vessel that turns carries its velocity round with it. In earth axes that is an acceleration, ``r`` times the velocity
at right angles to it, far larger than those along the body's axes; but it needs no guessing, because the yaw rate and
(from a first pass) the velocity are known. What is left of the track without it is as smooth as the body's own
accelerations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from preprocess.chains import Segments, Stream, assemble, variances
from preprocess.commanded import fitted_cost
from preprocess.levels import Levels, thin_out
from preprocess.smoother import ChainResult, first_guess, smooth_chain
from preprocess.trial import FloatArray, Measurement

#: Rows on which the track with and without its turning are compared, at most.
MOST_ROWS = 4_000


@dataclass(frozen=True)
class TurnedTrack:
    """Motion that follows from turning alone: ``t`` (n,) s; ``parts`` (3, n, 2) position, velocity, acceleration."""

    t: FloatArray
    parts: FloatArray

    def at(self, t: FloatArray, order: int) -> FloatArray:
        """Position (order 0), velocity or acceleration at any times, (k, 2); straight on beyond the ends."""
        value = self.parts[order]
        out = np.column_stack([np.interp(t, self.t, c) for c in value.T])
        if order == 0:
            beyond = np.minimum(t - self.t[0], 0.0) + np.maximum(t - self.t[-1], 0.0)
            end = np.where((t < self.t[0])[:, None], self.parts[1][0], self.parts[1][-1])
            out += beyond[:, None] * end
        return np.asarray(out, float)


def turned_track(track: ChainResult, heading: ChainResult) -> TurnedTrack | None:
    """Motion from the centripetal acceleration of a first pass; None where nothing was smoothed.

    Parameters
    ----------
    track, heading : ChainResult
        At the same times.
    """
    known = np.isfinite(track.mean[:, 1, 0]) & np.isfinite(heading.mean[:, 1, 0])
    if known.sum() < 3:
        return None
    t, velocity, r = track.t[known], track.mean[known, 1, :], heading.mean[known, 1, 0]
    acceleration = r[:, None] * np.column_stack([-velocity[:, 1], velocity[:, 0]])
    dt = np.diff(t)[:, None]
    before, after = acceleration[:-1], acceleration[1:]
    rate = _summed(0.5 * dt * (before + after))
    position = _summed(dt * rate[:-1] + dt**2 * (2.0 * before + after) / 6.0)
    return TurnedTrack(t, np.stack([position, rate, acceleration]))


def _summed(steps: FloatArray) -> FloatArray:
    return np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])


def without_turning(streams: tuple[Stream, ...], turned: TurnedTrack) -> tuple[Stream, ...]:
    """The streams less the motion that turning explains."""
    return tuple(replace(s, value=s.value - turned.at(s.t, s.order)) for s in streams)


def with_turning(track: ChainResult, turned: TurnedTrack, streams: tuple[Stream, ...]) -> ChainResult:
    """The smoothed rest with the motion that turning explains; its streams show the measured values again."""
    motion = np.stack([turned.at(track.t, k) for k in range(3)], axis=1)
    measured = tuple(replace(a, value=b.value) for a, b in zip(track.streams, streams, strict=True))
    return replace(track, mean=track.mean + motion, streams=measured)


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
    turned = turned_track(first, heading)
    cleaned = tuple(replace(s, good=f.good) for s, f in zip(streams, first.streams, strict=True))
    if turned is None or not _explains(cleaned, turned, first.levels, segments):
        return smooth_chain(cleaned, segments, wanted, inputs, beside=beside)
    rest = smooth_chain(without_turning(cleaned, turned), segments, wanted, inputs, beside=beside)
    return with_turning(rest, turned, streams)


def _explains(streams: tuple[Stream, ...], turned: TurnedTrack, levels: Levels, segments: Segments) -> bool:
    """Whether the track is likelier without the turning that the headings tell of (they may be wrong)."""
    return _cost(without_turning(streams, turned), levels, segments) < _cost(streams, levels, segments)


def _cost(streams: tuple[Stream, ...], levels: Levels, segments: Segments) -> float:
    assembled = assemble(streams, segments, np.empty(0))
    rows = replace(assembled.rows, variance=variances(assembled.stream, levels.sigma))
    return fitted_cost(thin_out(rows, assembled.stream, MOST_ROWS)[0], levels.q, first_guess(streams)[1])
