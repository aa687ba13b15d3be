"""How hard the inputs drive the vessel, over time: when they change, accelerations jump.

The logged inputs say when to expect more of the motion, not what: only the process intensity of a chain
follows them, as ``1 + B Σ (Δ/range)² e^(-(t - t_k)/τ)`` over the changes before. B and τ are chosen by
likelihood; B = 0, an even intensity, where the inputs explain nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numba import njit

from preprocess.chains import Drive, Segments, Stream, assemble, at_levels
from preprocess.descent import minimum
from preprocess.intensity import likeliest
from preprocess.kalman import Rows
from preprocess.levels import Levels, thin_out
from preprocess.likelihood import costs
from preprocess.trial import FloatArray, Measurement

#: Factors B and times τ (s) that are tried.
BOOSTS = (30.0, 1e3, 3e4)
TIMES = (0.15, 0.5, 1.5, 5.0)
#: Where a refined search may begin about the best of these, as logarithms of B, τ and the intensity times B.
NEIGHBOURS = np.array([(b, t, q) for b in (-2.0, 0.0, 2.0) for t in (-0.6, 0.0, 0.6) for q in (0.0, 0.7)])
#: Gain in -2 log likelihood below which the intensity stays even.
LEAST_GAIN = 10.0
#: Rows that they are tried on at most.
MOST_ROWS = 4_000


@njit(cache=True)
def _decaying_sum(t, jump, tau, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    total = 0.0
    for i in range(len(t)):
        if i > 0:
            total *= np.exp(-(t[i] - t[i - 1]) / tau)
        total += jump[i]
        out[i] = total


def changes(inputs: Mapping[str, Measurement]) -> tuple[FloatArray, FloatArray]:
    """Return the inputs' sample times (n,) s, and the squared change at each, in shares of the range.

    What was before the first sample nobody knows: it counts as a usual change.
    """
    moving = [m for m in inputs.values() if len(m.t) > 2 and np.ptp(m.value) > 0.0]
    if not moving:
        return np.empty(0), np.empty(0)
    t = np.unique(np.concatenate([m.t for m in moving]))
    jump = np.zeros(len(t))
    for m in moving:
        share = (np.diff(m.value[m.good]) / np.ptp(m.value[m.good])) ** 2
        usual = float(share[share > 0.0].mean()) if share.any() else 0.0
        jump[np.searchsorted(t, m.t[m.good])] += np.r_[usual, share]
    return t, jump


def profile(t: FloatArray, jump: FloatArray, boost: float, tau: float) -> Drive:
    """Return the drive for given B and τ."""
    total = np.empty(len(t))
    _decaying_sum(t, jump, tau, total)
    return Drive(t, np.log1p(boost * total))


def commanded_drive(
    streams: tuple[Stream, ...],
    segments: Segments,
    inputs: Mapping[str, Measurement],
    levels: Levels,
    prior: FloatArray,
) -> Drive | None:
    """Choose how the inputs drive a chain; None where an even intensity is as likely.

    Parameters
    ----------
    streams : tuple of Stream
    segments : tuple of (start, end)
    inputs : mapping of str to Measurement
    levels : Levels
        Noise levels to try with; the intensity is fitted anew for each trial.
    prior : (3,)
    """
    t, jump = changes(inputs)
    if not len(t):
        return None
    assembled = assemble(streams, segments, np.empty(0))
    rows, _ = thin_out(at_levels(assembled, levels.sigma), assembled.stream, MOST_ROWS)
    best, even = likeliest(rows, levels.q, prior)
    best -= LEAST_GAIN
    chosen: tuple[float, float, float] | None = None
    for tau in TIMES:
        for boost in BOOSTS:
            drive = profile(t, jump, boost, tau)
            driven = replace(rows, scale=np.exp(np.interp(rows.t, drive.t, drive.log_scale)))
            value, q = likeliest(driven, even / np.sqrt(boost), prior)
            if value < best:
                best, chosen = value, (boost, tau, q)
    return None if chosen is None else refined(rows, t, jump, chosen, prior)


def refined(
    rows: Rows, t: FloatArray, jump: FloatArray, start: tuple[float, float, float], prior: FloatArray
) -> Drive:
    """B and τ of the greatest likelihood near a first choice, the intensity (third of them) free beside."""

    def drives(x: FloatArray) -> list[Drive]:
        boost, tau = np.exp(np.clip(x[:, :2], -40.0, 40.0)).T
        return [profile(t, jump, b, c) for b, c in zip(boost, np.clip(tau, 0.02, 60.0), strict=True)]

    def objective(x: FloatArray) -> FloatArray:
        scale = [np.exp(np.interp(rows.t, d.t, d.log_scale)) for d in drives(x)]
        q = np.exp(np.clip(x[:, 2] - x[:, 0], -40.0, 40.0))
        return costs(rows, q, prior, scale=np.stack(scale, axis=1))

    boost, tau, q = start
    # after a change only the product of intensity and B shows
    about = np.log([boost, tau, q * boost]) + NEIGHBOURS
    first = about[int(np.argmin(objective(about)))]
    return drives(minimum(objective, first)[1][None])[0]
