"""The motion by the extended Kalman filter (``preprocess.ekf``), its process intensities of greatest likelihood."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from preprocess.chains import Segments, Stream, inside
from preprocess.ekf import Sights, in_order, run_filter
from preprocess.eso_motion import intensity
from preprocess.smoother import COLUMNS, ChainResult, states
from preprocess.trial import FloatArray

#: Columns of the filter that a stream's components show, by its name.
SHOWN = {"position": (0, 1), "heading": (2,), "yaw_rate": (5,), "velocity": (9, 10)}
#: Rows on which the intensities are looked for, at most, and evaluations of the likelihood.
MOST_ROWS, MOST_EVALUATIONS = 4_000, 120
#: How far they may lie from those in earth axes, in natural logarithms.
REACH = 8.0
#: Standard deviations of the first state: so many of the smoothed one's.
LOOSE = 10.0


def filtered_motion(
    track: ChainResult, heading: ChainResult, segments: Segments
) -> tuple[pd.DataFrame, dict[str, float]]:
    """States by the filter, in every segment anew.

    Parameters
    ----------
    track, heading : ChainResult
        Of the default smoother: samples in use, noise levels, and where the filter begins.
    segments : tuple of (start, end)

    Returns
    -------
    states : DataFrame
        As ``preprocess.smoother.states``.
    intensities : mapping of str to float
        Of surge, sway (m²/s⁵) and yaw (rad²/s⁵).
    """
    smoothed = states(track, heading)
    parts = [
        (sights_of((*track.streams, *heading.streams), levels_of(track, heading), s), s) for s in segments
    ]
    begun = [(sights, beginning(smoothed, s), s) for sights, s in parts if len(sights.t) > 8]
    out = smoothed.copy()
    out[list(out.columns.drop("t"))] = np.nan
    q: FloatArray = np.zeros(3)
    both = [intensity(c, segments) for c in (track, heading)] if begun else [0.0, 0.0]
    guess = np.array([both[0], both[0], both[1]])
    if begun:
        longest = max(begun, key=lambda p: len(p[0].t))
        q = likeliest(longest[0], longest[1], guess)
    for sights, (first, spread), (low, high) in begun:
        state, variance, _ = run_filter(sights, q, first, spread)
        last = np.append(np.diff(sights.t) > 0.0, True)
        rows = np.flatnonzero((out["t"] >= low) & (out["t"] <= high))
        t = out["t"].to_numpy()[rows]
        for k, name in enumerate(COLUMNS):
            out.loc[rows, name] = np.interp(t, sights.t[last], state[last, k])
            sigma = np.sqrt(np.maximum(variance[last, k], 0.0))
            out.loc[rows, f"sigma_{name}"] = np.interp(t, sights.t[last], sigma)
    return out, dict(zip(("surge", "sway", "yaw"), q.tolist(), strict=True))


def levels_of(*chains: ChainResult) -> dict[str, float]:
    """Noise of each stream, SI."""
    return {
        s.name: max(float(x), 1e-9) for c in chains for s, x in zip(c.streams, c.levels.sigma, strict=True)
    }


def sights_of(streams: Sequence[Stream], sigma: dict[str, float], segment: tuple[float, float]) -> Sights:
    """Samples in use of a segment, as the filter takes them."""
    parts = []
    for stream in streams:
        use = stream.good & (inside(stream.t, (segment,)) == 0)
        for k, which in enumerate(SHOWN[stream.name]):
            parts.append((stream.t[use], stream.value[use, k], which, sigma[stream.name]))
    return in_order(parts)


def beginning(smoothed: pd.DataFrame, segment: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """State at the begin of a segment and its standard deviations, (9,) each: loosely as smoothed."""
    first = smoothed[smoothed["t"] >= segment[0]].iloc[0]
    state = first[list(COLUMNS)].to_numpy(float)
    return state, LOOSE * first[[f"sigma_{c}" for c in COLUMNS]].to_numpy(float)


def likeliest(sights: Sights, first: tuple[FloatArray, FloatArray], q: FloatArray) -> FloatArray:
    """Process intensities of greatest likelihood, (3,), from a first guess."""
    from scipy.optimize import minimize

    few = Sights(sights.t[:MOST_ROWS], sights.which[:MOST_ROWS], sights.value[:MOST_ROWS],
                 sights.variance[:MOST_ROWS])  # fmt: skip

    guess = np.log(q)

    def intensities(x: FloatArray) -> FloatArray:
        return np.asarray(np.exp(np.clip(x, guess - REACH, guess + REACH)), float)

    def objective(x: FloatArray) -> float:
        cost = run_filter(few, intensities(x), *first)[2]
        return cost if np.isfinite(cost) else 1e300

    simplex = np.vstack([guess, guess - 2.0 * np.eye(3)])
    options = {"initial_simplex": simplex, "maxfev": MOST_EVALUATIONS, "xatol": 0.05, "fatol": 0.1}
    best = minimize(objective, guess, method="Nelder-Mead", options=options)  # type: ignore[call-overload]
    return intensities(np.asarray(best.x, float))
