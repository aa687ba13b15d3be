"""How hard the vessel is driven, over time: the intensity of a chain, adapted to its disturbances.

A vessel that steps its rudder now and then is not driven evenly. The smoothed disturbances (the auxiliary
residuals of Harvey and Koopman 1992) tell where more or less happened than the even intensity says: over
a sliding window as long as the smoother's own memory, their squared length is compared with its
expectation: the slope of the likelihood in the intensity there. A Gaussian prior on the logarithm of the
factor holds to the even intensity where the data say little.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from preprocess.chains import Assembled, Drive, Stream, at_levels
from preprocess.kalman import NONE, IntArray, Rows, smooth
from preprocess.levels import Levels
from preprocess.trial import FloatArray

#: Prior standard deviation of the logarithm of the factor.
PRIOR_SPREAD = 1.0
ITERATIONS = 5
LIMIT = float(np.log(1e3))
#: Half window as a multiple of the smoother's memory.
MEMORIES = 3.0
#: Then once more over this many sample intervals, for single steps of the actuators.
FAST = 1.5
FAST_SPREAD = 2.0
#: With a single stream, shorter memories (in sample intervals) leave nothing to adapt to.
LEAST_MEMORY = 1.3


def memory(streams: tuple[Stream, ...], levels: Levels) -> float:
    """Time over which the smoother averages, s: where noise and process have equal power."""
    out = []
    for stream, sigma in zip(streams, levels.sigma, strict=True):
        t = stream.t[stream.good]
        if len(t) > 2:
            step = float(np.median(np.diff(t)))
            out.append(max((sigma**2 * step / levels.q) ** (1.0 / (6 - 2 * stream.order)), step))
    return min(out, default=1.0)


def shortest_interval(streams: tuple[Stream, ...]) -> float:
    """Median interval of the fastest stream, s."""
    return min((float(np.median(np.diff(s.t))) for s in streams if len(s.t) > 1), default=1.0)


def window(t: FloatArray, half: float) -> tuple[IntArray, IntArray]:
    """First row, and the one after the last, within ``half`` seconds of each row; (n,) each."""
    return np.searchsorted(t, t - half), np.searchsorted(t, t + half, "right")


def window_sum(x: FloatArray, rows: tuple[IntArray, IntArray]) -> FloatArray:
    """Sum of ``x`` over the rows of each row's window; (n,)."""
    total = np.concatenate([[0.0], np.cumsum(x)])
    return np.asarray(total[rows[1]] - total[rows[0]])


def find_drive(
    streams: tuple[Stream, ...], assembled: Assembled, levels: Levels, prior: FloatArray
) -> Drive | None:
    """Adapt the process intensity over time, given the noise levels.

    Parameters
    ----------
    streams : tuple of Stream
    assembled : Assembled
        Its rows' ``scale`` is where the search starts.
    levels : Levels
    prior : (3,)

    Returns
    -------
    Drive or None
        None where the samples are too far apart to tell.
    """
    span, step = memory(streams, levels), shortest_interval(streams)
    if len(streams) == 1 and span < LEAST_MEMORY * step:
        return None
    rows = at_levels(assembled, levels.sigma)
    base = np.log(rows.scale)
    slow = _adapt(rows, levels, prior, base, base, MEMORIES * span, PRIOR_SPREAD)
    return Drive(rows.t, _adapt(rows, levels, prior, slow, slow, FAST * step, FAST_SPREAD))


def _adapt(
    rows: Rows,
    levels: Levels,
    prior: FloatArray,
    log_scale: FloatArray,
    towards: FloatArray,
    half: float,
    spread: float,
) -> FloatArray:
    """Re-estimate the intensity over a window, held to ``towards`` within ``spread`` (standard deviation)."""
    about = window(rows.t, half)
    for _ in range(ITERATIONS):
        out = smooth(replace(rows, scale=np.exp(log_scale)), levels.q, prior, NONE)
        found, expected = window_sum(out.drive, about), window_sum(out.drive_expected, about)
        slope = 0.5 * (found - expected) - (log_scale - towards) / spread**2
        step = slope / (0.5 * np.maximum(found, expected) + 1.0 / spread**2)
        log_scale = np.clip(log_scale + np.clip(step, -2.0, 2.0), -LIMIT, LIMIT)
    return log_scale
