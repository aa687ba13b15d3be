"""Heading, yaw rate and yaw acceleration by the five-state ESO for the Nomoto model (``preprocess.nomoto_eso``).

What a vessel steers with is the mean of its rudders; a log has the angle that was set or the one that was reached, and
the observer's own rudder serves neither, so the gear's time constant is taken for one sample interval. The bandwidth
that is not given is that of the least expected error of the yaw rate, as for the third-order ESO.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from preprocess.chains import Segments, Stream
from preprocess.eso_motion import BANDWIDTHS, FASTEST, WARM_UP, intensity, local_interval, samples_in
from preprocess.nomoto_eso import NomotoObserver, gains, observe_nomoto
from preprocess.response import held_at
from preprocess.smoother import ChainResult
from preprocess.trial import FloatArray, Measurement

#: Places of ψ, ψ̇ and ψ̈ among the observer's states.
TURNING = (0, 1, 3)


def turned(
    heading: ChainResult,
    segments: Segments,
    rudders: Mapping[str, Measurement],
    bandwidth: float | None = None,
) -> tuple[ChainResult, float]:
    """The heading's chain by the observer, and its bandwidth, rad/s.

    Parameters
    ----------
    heading : ChainResult
        Of the default smoother: its compass alone is observed.
    segments : tuple of (start, end)
    rudders : mapping of str to Measurement
    bandwidth : float, optional
    """
    compass, sigma = heading.streams[0], float(heading.levels.sigma[0])
    q = intensity(heading, segments)
    w = bandwidth or best_bandwidth(compass, sigma, q)
    noise, behind = error_covariances(w)
    mean, covariance = np.full_like(heading.mean, np.nan), np.full_like(heading.covariance, np.nan)
    for (low, high), (t, psi) in samples_in(compass, segments):
        seen = observed(w, t, psi[:, 0], rudders)
        at = np.flatnonzero((heading.t >= low) & (heading.t <= high))
        for k, place in enumerate(TURNING):
            mean[at, k, 0] = np.interp(heading.t[at], t, seen[:, place])
        h = np.interp(heading.t[at], t, local_interval(t))
        covariance[at] = sigma**2 * h[:, None, None] * noise + q * behind
    return replace(heading, mean=mean, covariance=covariance), w


def observed(
    bandwidth: float, t: FloatArray, psi: FloatArray, rudders: Mapping[str, Measurement]
) -> FloatArray:
    """States (n, 5) of the observer, which runs backwards through the first samples to begin in motion."""
    observer = NomotoObserver(bandwidth, float(np.median(np.diff(t))))
    steered = [held_at(m, t) for m in rudders.values()]
    delta = np.mean(steered, axis=0) if steered else np.zeros(len(t))
    last = max(int(np.searchsorted(t, t[0] + WARM_UP / bandwidth)), 5)
    back = observe_nomoto(observer, t[0] - t[:last][::-1], psi[:last][::-1], delta[:last][::-1])[-1]
    first = back * np.array([1.0, -1.0, 1.0, 1.0, -1.0])
    return observe_nomoto(observer, t, psi, delta, first)


def error_covariances(bandwidth: float) -> tuple[FloatArray, FloatArray]:
    """Covariance of ψ, ψ̇, ψ̈ as observed, for noise and for a white ψ⃛ of intensity one, (3, 3) each."""
    from scipy.linalg import solve_continuous_lyapunov

    gain = gains(np.full(4, -bandwidth))
    a = np.diag([1.0, 1.0, 1.0], 1)
    a[:, 0] -= gain
    process = np.zeros((4, 4))
    process[2, 2] = 1.0
    both = (solve_continuous_lyapunov(a, -x) for x in (np.outer(gain, gain), process))
    noise, behind = (np.asarray(x, float)[:3, :3] for x in both)
    return noise, behind


def best_bandwidth(stream: Stream, sigma: float, q: float) -> float:
    """Bandwidth at which the yaw rate is expected to err least, rad/s."""
    step = float(np.median(np.diff(stream.t[stream.good])))
    tried = BANDWIDTHS[BANDWIDTHS * step < FASTEST]
    both = [error_covariances(float(w)) for w in tried]
    error = [sigma**2 * step * noise[1, 1] + q * behind[1, 1] for noise, behind in both]
    return float(tried[int(np.argmin(error))])
