"""Errors of the position that wander: whether they show against the motion, and how large they are.

Against a smooth motion (of a large vessel, or told by Doppler velocities) white noise and a wander differ: by
likelihood, over the intensities of the motion and of all noises together. Small wanders of an agile vessel cannot be
told from its motion, and are not claimed; they do not matter to its velocities either.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from preprocess.chains import Segments, assemble, at_levels, variances
from preprocess.first_levels import first_guess
from preprocess.kalman import IntArray, Rows
from preprocess.levels import Levels, thin_out
from preprocess.smoother import ChainResult, at_times
from preprocess.trial import FloatArray
from preprocess.wander_kalman import Wander, smooth_with_wander, wander_cost

#: Time constant with which a wander is looked for, s, and those that are tried once there is one.
FIRST_TIME, TIMES = 60.0, (10.0, 25.0, 60.0, 150.0)
#: Gain in -2 log likelihood below which there is none; time constants less apart than this are not told apart, and
#: the longest is taken: of its level, only what the wander does within the log matters.
LEAST_GAIN, INDISTINCT = 10.0, 6.0
#: Rows on which it is looked for, at most, and evaluations of the likelihood in a search.
MOST_ROWS, MOST_EVALUATIONS = 3_000, 120
#: A wander of less than this share of the position's white noise is none: the gain was in the other levels.
NO_SIZE = 1e-3
#: Fewer samples of the position tell nothing.
LEAST_SAMPLES = 100


def allow_for_wander(track: ChainResult, segments: Segments) -> ChainResult:
    """The track smoothed anew with a wander of its positions, where the data show one; else as it is.

    Parameters
    ----------
    track : ChainResult
        Its streams' values are those that were smoothed.
    segments : tuple of (start, end)
    """
    if int(track.streams[0].good.sum()) < LEAST_SAMPLES:
        return track
    prior = first_guess(track.streams)[1]
    found = find_wander(track, segments, prior)
    if found is None:
        return track
    levels, wander = found
    assembled = assemble(track.streams, segments, track.t, track.drive)
    rows = at_levels(assembled, levels.sigma)
    mean, covariance = smooth_with_wander(rows, levels.q, prior, wander)
    at = at_times(assembled, mean[:, :3], covariance[:, :3, :3], track.t)
    return replace(track, mean=at[0], covariance=at[1], levels=levels, wander=wander)


def find_wander(track: ChainResult, segments: Segments, prior: FloatArray) -> tuple[Levels, Wander] | None:
    """Levels of motion and noise beside a wander, and the wander; None where none shows."""
    assembled = assemble(track.streams, segments, np.empty(0), track.drive)
    rows, stream = thin_out(assembled.rows, assembled.stream, MOST_ROWS)
    start = np.log(np.r_[track.levels.q, np.maximum(track.levels.sigma, 1e-9)])
    alone = _search(rows, stream, prior, start, None)
    first = _search(rows, stream, prior, np.r_[alone[1], alone[1][1] + 1.1], FIRST_TIME)
    if not LEAST_GAIN <= alone[0] - first[0] < np.inf:
        return None
    tried = {time: _search(rows, stream, prior, first[1], time) for time in TIMES}
    least = min(first[0], *(cost for cost, _ in tried.values()))
    time = max((k for k, (cost, _) in tried.items() if cost < least + INDISTINCT), default=FIRST_TIME)
    q, *sigma, wander = np.exp(tried[time][1])
    if wander < NO_SIZE * sigma[0]:
        return None
    return Levels(float(q), np.array(sigma)), Wander(float(wander), time)


def _search(
    rows: Rows, stream: IntArray, prior: FloatArray, start: FloatArray, time: float | None
) -> tuple[float, FloatArray]:
    """Least -2 log likelihood, and the logarithms of intensity, noises and (with a ``time``) wander there."""
    from scipy.optimize import minimize

    count = len(start) - (time is not None)

    def objective(x: FloatArray) -> float:
        x = np.clip(x, -60.0, 40.0)
        weighted = replace(rows, variance=variances(stream, np.exp(x[1:count])) * rows.variance)
        wander = Wander(1e-9, FIRST_TIME) if time is None else Wander(float(np.exp(x[-1])), time)
        return wander_cost(weighted, float(np.exp(x[0])), prior, wander)

    simplex = np.vstack([start, start + np.diag([-1.0, *np.full(len(start) - 1, 0.2)])])
    options = {"initial_simplex": simplex, "maxfev": MOST_EVALUATIONS, "xatol": 2e-2, "fatol": 0.1}
    best = minimize(objective, start, method="Nelder-Mead", options=options)  # type: ignore[call-overload]
    return float(best.fun), np.asarray(best.x, float)
