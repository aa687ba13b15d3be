"""A manoeuvre over draws from the parameters' covariance: whole, or to first order where these cannot be sailed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from identify.misfit import SMALL
from identify.simulate.intervals import FEW, Draws
from identify.simulate.plant import Plant, Track
from identify.simulate.rebuild import Rebuilt

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Values = Mapping[str, float]
Sailing = Callable[[Plant], tuple[Track, dict[str, float]]]

#: Where more of the whole draws than this fail, their slope says nothing either.
MOST = 0.5
#: Tracks kept for a plot.
TRACKS = 30


def drawn(plant: Plant, values: Values, sail: Sailing, count: int, seed: int, *, linear: bool) -> Draws:
    """The manoeuvre over draws of the parameters.

    Parameters
    ----------
    plant : Plant
    values : mapping of str to float
        The measures with the parameters as identified.
    sail : callable
        The manoeuvre with a plant: its track and its measures.
    count, seed : int
        Of the draws.
    linear : bool
        The covariance holds to first order alone: far from the noise it is made so large that it accounts for the
        errors of logs left out by their slopes (``identify.misfit``). Where too many whole draws fail, smaller ones
        say what the slopes of the measures make of it.
    """
    found, tracks = _sailed(plant, sail, draw(plant.rebuilt, count, seed))
    failed = len(found) - len(tracks)
    kept = _padded(tracks[:TRACKS])
    if not linear or not FEW * count < failed <= MOST * count:
        return Draws(_by_name(found), kept, len(found), failed)
    small, _ = _sailed(plant, sail, draw(plant.rebuilt, count, seed, SMALL))
    whole = {n: values[n] + (v - values[n]) / SMALL for n, v in _by_name(small).items()}
    return Draws(whole, kept, len(found), failed, linear=True, positive=_positive(_by_name(found)))


def _positive(whole: Mapping[str, FloatArray]) -> frozenset[str]:
    """Measures that no whole draw (k,) which could be sailed has below nothing: a distance, a time."""
    known = {n: v[np.isfinite(v)] for n, v in whole.items()}
    return frozenset(n for n, v in known.items() if len(v) and v.min() >= 0.0)


def _sailed(
    plant: Plant, sail: Sailing, drawn: FloatArray
) -> tuple[list[dict[str, float]], list[FloatArray]]:
    """Measures with every vector of parameters, NaN where it cannot be sailed, and the tracks of those that can."""
    found, tracks = [], []
    for p in drawn:
        track, values = sail(plant.with_parameters(p))
        good = track.finite and any(math.isfinite(v) for v in values.values())
        found.append(values if good else dict.fromkeys(values, math.nan))
        tracks += [track.states[:, :2]] if good else []
    return found, tracks


def _by_name(found: list[dict[str, float]]) -> dict[str, FloatArray]:
    return {n: np.array([f[n] for f in found]) for n in (found[0] if found else ())}


def draw(rebuilt: Rebuilt, count: int, seed: int, share: float = 1.0) -> FloatArray:
    """Parameter vectors (count, np) a ``share`` of their standard errors away, within their bounds.

    What leaves its bounds is brought back to them, and what goes with it comes along: of two of which only
    the sum is known, one at its bound leaves the other to make up for it.
    """
    rng = np.random.default_rng(seed)
    covariance = rebuilt.covariance
    values, vectors = np.linalg.eigh(covariance)
    root = share * vectors * np.sqrt(np.maximum(values, 0.0))
    drawn = rebuilt.p + rng.standard_normal((count, len(rebuilt.p))) @ root.T
    low, high = (np.array([s.parameter.bounds[k] for s in rebuilt.structure.slots]) for k in (0, 1))
    for k in np.nonzero((np.isfinite(low) | np.isfinite(high)) & (np.diag(covariance) > 0.0))[0]:
        back = np.clip(drawn[:, k], low[k], high[k]) - drawn[:, k]
        drawn += np.outer(back, covariance[:, k] / covariance[k, k])
    return np.asarray(np.clip(drawn, low, high), dtype=float)


def _padded(tracks: list[FloatArray]) -> FloatArray:
    longest = max((len(t) for t in tracks), default=0)
    out = np.full((len(tracks), longest, 2), np.nan)
    for row, track in zip(out, tracks, strict=True):
        row[: len(track)] = track
    return out
