"""The track smoothed with measured accelerations beside positions and velocities, where they are worth it.

An inertial sensor that is not quite level measures gravity, one on a shaking deck measures the deck, and an attitude
that was made of the same accelerations is wrong whenever it matters. So their constant errors are taken off against
the motion that the other sensors show, their noise is estimated like any other, and they are used only where they
foretell positions that were held back over gaps better than the other sensors alone do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from preprocess import frames
from preprocess.accelerations import Accelerations
from preprocess.chains import Segments, Stream, inside
from preprocess.known_motion import KnownMotion, less, plus
from preprocess.outliers import sliding_three_sigma
from preprocess.smoother import ChainResult, smooth_chain
from preprocess.trial import BoolArray, FloatArray, Measurement
from preprocess.turning import turned_track
from preprocess.wander import allow_for_wander

#: Accelerations are averaged over this, s: shaking is faster than a vessel moves.
BIN = 0.1
#: Position samples that are held back in a row, and left in between; share of their error that must go.
HELD_BACK, LEAST_GAIN = 8, 0.03
#: What does not go with the accelerations that the other sensors show, between these factors, is something else.
SCALES = (0.5, 1.5)
#: Multiple of the local spread beyond which an acceleration is set aside.
GROSS = 6.0
#: Fewer samples tell nothing.
LEAST_SAMPLES = 50


@dataclass(frozen=True)
class Worth:
    """What came of the accelerations: whether they are used, the share of the held-back error that is left with them.

    ``bias`` (2,) and ``sigma``, m/s², are their constant errors, forward and starboard, and their noise; ``scale`` is
    their line over the accelerations that the other sensors show.
    """

    used: bool
    left: float
    bias: tuple[float, float]
    scale: float
    sigma: float
    source: str
    upright: bool

    def __str__(self) -> str:
        tilt = "the vessel taken for upright" if self.upright else "less gravity by roll and pitch"
        if not self.used:
            return f"Accelerations ({self.source}, {tilt}) foretell the positions no better: not used."
        return (
            f"Accelerations ({self.source}, {tilt}) are used: with them positions that are held back are missed by "
            f"{1.0 - self.left:.0%} less; noise {self.sigma:.2g} m/s²."
        )


def with_accelerations(
    track: ChainResult,
    heading: ChainResult,
    measured: Accelerations | None,
    arm: tuple[float, float],
    segments: Segments,
    inputs: Mapping[str, Measurement],
) -> tuple[ChainResult, Worth | None]:
    """The track smoothed with accelerations too, where they are worth it; else as it is.

    Parameters
    ----------
    track, heading : ChainResult
        Smoothed without.
    measured : Accelerations, optional
    arm : (forward, starboard) m
        Where they are measured, from the campaign's origin.
    segments : tuple of (start, end)
    inputs : mapping of str to Measurement
    """
    found = None if measured is None else accelerations_of(measured, track, heading, arm, segments)
    turned = None if found is None else turned_track(track, heading)
    if measured is None or found is None or turned is None:
        return track, None
    stream, bias, scale = found
    given = tuple(
        replace(s, sigma=float(x), candidate=s.good)
        for s, x in zip(track.streams, track.levels.sigma, strict=True)
    )
    left, sigma = held_back(given, stream, turned, segments, inputs)
    used = left < 1.0 - LEAST_GAIN and SCALES[0] < scale < SCALES[1]
    worth = Worth(used, left, bias, scale, sigma, measured.source, measured.upright)
    if not worth.used:
        return track, worth
    every = (*given, replace(stream, sigma=sigma))
    rest = smooth_chain(less(every, turned), segments, track.t, inputs, rounds=0)
    if track.wander is not None:
        rest = allow_for_wander(rest, segments)
    smoothed = plus(rest, turned, every)
    levels = replace(smoothed.levels, sigma=smoothed.levels.sigma[:-1])
    return replace(smoothed, streams=track.streams, levels=levels), worth


def accelerations_of(
    measured: Accelerations,
    track: ChainResult,
    heading: ChainResult,
    arm: tuple[float, float],
    segments: Segments,
) -> tuple[Stream, tuple[float, float], float] | None:
    """Accelerations of the origin to the north and east, the constant errors that were taken off, and their scale."""
    known = np.isfinite(track.mean[:, 2, 0]) & np.isfinite(heading.mean[:, 2, 0])
    t, value = binned(measured.t, measured.value)
    use = inside(t, segments) >= 0
    t, value = t[use], value[use]
    if known.sum() < LEAST_SAMPLES or len(t) < LEAST_SAMPLES:
        return None
    at = track.t[known]
    psi, r, dr = (np.interp(t, at, heading.mean[known, k, 0]) for k in range(3))
    value = value - np.column_stack([-dr * arm[1] - r**2 * arm[0], dr * arm[0] - r**2 * arm[1]])
    smoothed = np.column_stack([np.interp(t, at, c) for c in track.mean[known, 2].T])
    beyond = value - frames.earth_to_body(smoothed, psi)
    good = ~sliding_three_sigma(t, beyond, k=GROSS)
    bias = beyond[good].mean(
        axis=0
    )  # a mean, for that of an acceleration is known to the velocities at both ends
    value = frames.body_to_earth(value - bias, psi)
    shown = smoothed - smoothed[good].mean(axis=0)
    scale = float((shown * value)[good].sum() / max((shown**2)[good].sum(), 1e-12))
    return Stream("acceleration", t, value, 2, good, good), (float(bias[0]), float(bias[1])), scale


def binned(t: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Averages over bins of ``BIN`` s: times (k,) and values (k, 2)."""
    _, of = np.unique(np.floor(t / BIN), return_inverse=True)
    count = np.bincount(of)
    return np.bincount(of, t) / count, np.column_stack([np.bincount(of, c) / count for c in value.T])


def held_back(
    streams: tuple[Stream, ...],
    accelerations: Stream,
    turned: KnownMotion,
    segments: Segments,
    inputs: Mapping[str, Measurement],
) -> tuple[float, float]:
    """Share of the error of positions held back over gaps that is left with accelerations, and their noise."""
    position = streams[0]
    aside = every_other(position)
    rest = (replace(position, good=position.good & ~aside, candidate=position.good & ~aside), *streams[1:])
    wanted = position.t[aside & (inside(position.t, segments) >= 0)]
    if len(wanted) < LEAST_SAMPLES // 2:
        return 1.0, float("nan")
    known = np.array([np.interp(wanted, position.t, c) for c in position.value.T]).T
    errors = []
    for tried in (rest, (*rest, accelerations)):
        made = smooth_chain(less(tried, turned), segments, wanted, inputs, rounds=0)
        error = made.mean[:, 0] + turned.at(wanted, 0) - known
        errors.append(float(np.sqrt(np.nanmean(error**2))))
    return errors[1] / max(errors[0], 1e-12), float(made.levels.sigma[-1])


def every_other(position: Stream) -> BoolArray:
    """Good samples in every other run of ``HELD_BACK``, (n,) bool."""
    out = np.zeros(len(position.t), dtype=bool)
    use = np.flatnonzero(position.good)
    out[use] = (np.arange(len(use)) // HELD_BACK) % 2 == 1
    return out
