"""The part of the turning that the inputs explain: known of it, samples can be judged between hard steps.

An agile vessel steps its yaw acceleration with its inputs, faster than a slow compass or a thinned gyro samples it.
Judged by kinematics alone, a wild sample there could be motion, and motion noise. A linear response of the yaw rate
to the inputs, fitted in the weak form to a first pass, tells them apart. It serves to judge samples and to find the
sensors' noise; the smoothed motion itself is kept free of it, because models are later measured against that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from preprocess.chains import Segments, Stream
from preprocess.gyro_bias import without_bias
from preprocess.known_motion import KnownMotion, explains, less
from preprocess.response import even_grid, forces, linear_response, moving_inputs
from preprocess.smoother import ChainResult, smooth_chain
from preprocess.trial import FloatArray, Measurement


def smooth_heading(
    streams: tuple[Stream, ...],
    speed: tuple[FloatArray, FloatArray],
    segments: Segments,
    wanted: FloatArray,
    inputs: Mapping[str, Measurement],
    beside: Segments,
) -> ChainResult:
    """Smooth heading and yaw rate, their samples judged against what the inputs explain where that says more.

    Parameters
    ----------
    streams : tuple of Stream
    speed : (n,) s, (n,) m/s
        Roughly, over time.
    segments, wanted, inputs, beside
        See ``smooth_chain``.
    """
    streams = without_bias(streams)
    first = smooth_chain(streams, segments, wanted, inputs, beside=beside, rounds=1)
    driven = driven_turn(first, speed, segments, inputs)
    cleaned = with_verdicts(streams, first)
    if driven is None or not explains(cleaned, driven, first.levels, segments):
        return smooth_chain(cleaned, segments, wanted, inputs, beside=beside)
    anew = tuple(replace(s, judged=False) for s in less(cleaned, driven))
    rest = smooth_chain(anew, segments, np.empty(0), inputs, beside=beside)
    return smooth_chain(as_judged(streams, rest), segments, wanted, inputs, beside=beside, rounds=0)


def with_verdicts(streams: tuple[Stream, ...], chain: ChainResult) -> tuple[Stream, ...]:
    """The streams with the samples in use that a chain used; others may come back."""
    return tuple(replace(s, good=c.good, judged=True) for s, c in zip(streams, chain.streams, strict=True))


def as_judged(streams: tuple[Stream, ...], chain: ChainResult) -> tuple[Stream, ...]:
    """The streams with the verdicts and the noise that a chain found for good."""
    return tuple(
        replace(s, good=c.good, candidate=c.good, sigma=float(sigma))
        for s, c, sigma in zip(streams, chain.streams, chain.levels.sigma, strict=True)
    )


def driven_turn(
    first: ChainResult,
    speed: tuple[FloatArray, FloatArray],
    segments: Segments,
    inputs: Mapping[str, Measurement],
) -> KnownMotion | None:
    """Turn that a linear response to the inputs gives from rest; None where there is nothing to fit it to."""
    moving, known = moving_inputs(inputs), np.isfinite(first.mean[:, 1, 0])
    if not moving or known.sum() < 20:
        return None
    t, r = first.t[known], first.mean[known, 1, 0]
    grid = even_grid(t)
    columns = forces(moving, grid, np.interp(grid, *speed))
    found = linear_response(grid, np.interp(grid, t, r), columns, segments)
    if found is None:
        return None
    steps = 0.5 * np.diff(grid) * (found.value[1:] + found.value[:-1])
    angle = np.concatenate([[0.0], np.cumsum(steps)])
    return KnownMotion(grid, np.stack([angle, found.value, found.derivative])[:, :, None])
