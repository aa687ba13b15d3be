"""The motion by the third-order ESO of each channel (``preprocess.eso``), with its uncertainty.

Two things make an observer err: noise, the more the greater its bandwidth, and what it has not caught up with, the
more the smaller. Both follow from the noise of the sensor and the process intensity that the data show, by the
Lyapunov equation of the observer's error; the bandwidth that is not given is that of the least sum, for the rate.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from preprocess.chains import Segments, Stream, assemble, at_levels, inside
from preprocess.eso import Observer, filter_like, observe
from preprocess.first_levels import first_guess
from preprocess.intensity import fitted_intensity
from preprocess.kalman import IntArray
from preprocess.levels import thin_out
from preprocess.nomoto_eso import filter_like_rate
from preprocess.smoother import ChainResult, states
from preprocess.trial import FloatArray, Step

#: Time for which the observer runs backwards first, so that it begins in motion; in units of one over its bandwidth.
WARM_UP = 8.0
#: Bandwidths that are tried, rad/s, and rows on which the process intensity is looked for, at most.
BANDWIDTHS = np.geomspace(0.02, 50.0, 80)
MOST_ROWS = 6_000
#: A yaw rate above this share of the bandwidth is beyond what an observer can be corrected for.
TURNING = 0.3
#: Fewer samples in a segment are not observed.
LEAST_SAMPLES = 6
#: An observer that is faster than this many radians per sample does nothing but follow the samples.
FASTEST = 2.0


def observed_motion(
    track: ChainResult, heading: ChainResult, segments: Segments, bandwidth: float | None = None
) -> tuple[pd.DataFrame, dict[str, float]]:
    """States by the observers of all channels.

    Parameters
    ----------
    track, heading : ChainResult
        Of the default smoother.
    segments : tuple of (start, end)
    bandwidth : float, optional
        rad/s, of all channels; None: by channel.

    Returns
    -------
    states : DataFrame
        As ``preprocess.smoother.states``.
    bandwidths : mapping of stream to rad/s
    """
    found: dict[str, float] = {}
    turned = observed(heading, segments, bandwidth, found)
    moved = observed(track, segments, bandwidth, found)
    return states(carried_round(moved, turned.mean[:, 1, 0], found), turned), found


def carried_round(track: ChainResult, r: FloatArray, bandwidths: Mapping[str, float]) -> ChainResult:
    """The track without what its observers make of a velocity only because it turns with the vessel.

    A velocity that is even along the body's axes goes round in earth axes at the yaw rate (n,) ``r``: an observer shows
    it by its transfer function at ``s = j r``, a complex factor for north and east together, which is divided out.
    """
    mean, w = track.mean.copy(), bandwidths.get("velocity", bandwidths["position"])
    s = 1j * np.clip(np.nan_to_num(r), -TURNING * w, TURNING * w)
    if "velocity" in bandwidths:
        factors = 1.0 - (s / (s + w)) ** 3, w * w * (3.0 * s + w) / (s + w) ** 3
    else:
        factors = w * w * (3.0 * s + w) / (s + w) ** 3, (w / (s + w)) ** 3
    for k, factor in zip((1, 2), factors, strict=True):
        both = (mean[:, k, 0] + 1j * mean[:, k, 1]) / factor
        mean[:, k, 0], mean[:, k, 1] = both.real, both.imag
    return replace(track, mean=mean)


def observed(
    chain: ChainResult, segments: Segments, bandwidth: float | None, found: dict[str, float]
) -> ChainResult:
    """A chain by the observers of its sensors: a rate that is measured takes the place of one that is derived."""
    q = intensity(chain, segments)
    mean, covariance = np.full_like(chain.mean, np.nan), np.full_like(chain.covariance, np.nan)
    for stream, sigma in zip(chain.streams, chain.levels.sigma.tolist(), strict=True):
        observer = Observer(bandwidth or best_bandwidth(stream, sigma, q))
        found[stream.name] = observer.bandwidth
        noise, behind = error_covariances(observer, stream.order)
        count = 3 - stream.order
        for at, part, h in runs(stream, segments, observer, chain.t):
            mean[at, stream.order :] = part[:, :count]
            spread = sigma**2 * h[:, None, None] * noise + q * behind
            covariance[at, stream.order :, stream.order :] = spread[:, :count, :count]
            covariance[at, : stream.order, stream.order :] = covariance[
                at, stream.order :, : stream.order
            ] = 0.0
    return replace(chain, mean=mean, covariance=covariance)


def runs(
    stream: Stream, segments: Segments, observer: Observer, wanted: FloatArray
) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
    """Per segment: indices of the wanted times in it, the observer's states there (k, 3, m), sample intervals (k,)."""
    for (low, high), (t, value) in samples_in(stream, segments):
        seen = observe(observer, t, value, start(observer, t, value))
        at = np.flatnonzero((wanted >= low) & (wanted <= high))
        yield at, between(t, seen, wanted[at]), np.interp(wanted[at], t, local_interval(t))


def samples_in(
    stream: Stream, segments: Segments
) -> Iterator[tuple[tuple[float, float], tuple[FloatArray, FloatArray]]]:
    """Segments with a few samples in them at least, and the times (n,) and values (n, m) of those."""
    use, of = stream.good, inside(stream.t, segments)
    for k, segment in enumerate(segments):
        mine = use & (of == k)
        if mine.sum() >= LEAST_SAMPLES:
            yield segment, (stream.t[mine], stream.value[mine])


def start(observer: Observer, t: FloatArray, value: FloatArray) -> FloatArray:
    """State of the observer at the first sample, (3, m): from a run backwards through the first ones."""
    last = max(int(np.searchsorted(t, t[0] + WARM_UP / observer.bandwidth)), 4)
    back = observe(observer, t[0] - t[:last][::-1], value[:last][::-1])[-1]
    return np.asarray(back * np.array([[1.0], [-1.0], [1.0]]), float)


def between(t: FloatArray, seen: FloatArray, wanted: FloatArray) -> FloatArray:
    """States (n, 3, m) at other times, straight between the samples."""
    flat = seen.reshape(len(t), -1).T
    return np.column_stack([np.interp(wanted, t, c) for c in flat]).reshape(len(wanted), *seen.shape[1:])


def local_interval(t: FloatArray, around: int = 5) -> FloatArray:
    """Interval between samples about each, on average over some; (n,) s."""
    index = np.arange(len(t))
    low, high = np.maximum(index - around, 0), np.minimum(index + around, len(t) - 1)
    return np.asarray((t[high] - t[low]) / (high - low), float)


def intensity(chain: ChainResult, segments: Segments) -> float:
    """Process intensity of a chain as it is measured, nothing of its motion known beforehand."""
    assembled = assemble(chain.streams, segments, np.empty(0))
    rows, _ = thin_out(at_levels(assembled, chain.levels.sigma), assembled.stream, MOST_ROWS)
    guess, prior = first_guess(chain.streams)
    return fitted_intensity(rows, fitted_intensity(rows, guess.q, prior), prior)


def error_covariances(observer: Observer, order: int) -> tuple[FloatArray, FloatArray]:
    """Covariance of the observer's error for measurement noise of intensity one, and for a process of intensity one.

    Parameters
    ----------
    observer : Observer
    order : int
        Of what it observes: the white noise is the third derivative of the chain's position, so the third of a
        position and the second of a rate.
    """
    from scipy.linalg import solve_continuous_lyapunov

    w = observer.bandwidth
    gain = np.array([3.0 * w, 3.0 * w**2, w**3])
    a = np.diag([1.0, 1.0], 1)
    a[:, 0] -= gain
    process = np.zeros((3, 3))
    process[2 - order, 2 - order] = 1.0
    return (
        np.asarray(solve_continuous_lyapunov(a, -np.outer(gain, gain)), float),
        np.asarray(solve_continuous_lyapunov(a, -process), float),
    )


def best_bandwidth(stream: Stream, sigma: float, q: float) -> float:
    """Bandwidth at which the derivative of what is measured is expected to err least, rad/s."""
    step = float(np.median(np.diff(stream.t[stream.good])))
    tried = BANDWIDTHS[BANDWIDTHS * step < FASTEST]
    both = [error_covariances(Observer(float(w)), stream.order) for w in tried]
    error = [sigma**2 * step * noise[1, 1] + q * behind[1, 1] for noise, behind in both]
    return float(tried[int(np.argmin(error))])


def bandwidths_of(history: Iterable[Step]) -> dict[str, float]:
    """Bandwidths of the observers that a trial's motion comes from, rad/s by sensor; empty where there are none."""
    for step in history:
        found = step.arguments.get("bandwidth") if step.action == "observe" else None
        if isinstance(found, Mapping):
            return {str(k): float(w) for k, w in found.items()}
    return {}


def seen_like_velocity(bandwidths: Mapping[str, float], t: FloatArray, signals: FloatArray) -> FloatArray:
    """Signals (n, m) as the observers of position or Doppler velocity show u and v."""
    if "velocity" in bandwidths:
        return observe(Observer(bandwidths["velocity"]), t, signals)[:, 0]
    return filter_like(Observer(bandwidths["position"]), t, signals) if "position" in bandwidths else signals


def seen_like_yaw_rate(bandwidths: Mapping[str, float], t: FloatArray, signals: FloatArray) -> FloatArray:
    """Signals (n, m) as the observers of heading or gyro show r."""
    if "yaw_rate" in bandwidths:
        return observe(Observer(bandwidths["yaw_rate"]), t, signals)[:, 0]
    if "nomoto" in bandwidths:
        return filter_like_rate(bandwidths["nomoto"], t, signals)
    return filter_like(Observer(bandwidths["heading"]), t, signals) if "heading" in bandwidths else signals
