"""The default smoother: from all sensors at their own times to the vessel's motion.

The heading chain (ψ, r, ṙ) is smoothed first; with it the antenna's lever arm is taken off positions and
velocities, which makes the chains of north and east linear. Body velocities, accelerations and their standard
deviations follow from both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from preprocess import frames
from preprocess.chains import Assembled, Drive, Segments, Stream, assemble, at_levels
from preprocess.commanded import commanded_drive
from preprocess.drive import find_drive
from preprocess.first_levels import bounds_of, chain_levels, first_guess
from preprocess.gate import gate, truncation
from preprocess.kalman import smooth
from preprocess.levels import Levels
from preprocess.outliers import sliding_three_sigma
from preprocess.trial import FloatArray, Measurement
from preprocess.wander_kalman import Wander

#: Rounds of estimating noise levels and setting outliers aside.
ROUNDS = 4
#: Multiple of the local spread beyond which a sample is not even used for the first estimate.
GROSS = 6.0
#: Share of samples whose verdict may still change when the rounds end.
NEGLIGIBLE = 5e-4
COLUMNS = ("x", "y", "psi", "u", "v", "r", "du", "dv", "dr")


@dataclass(frozen=True)
class ChainResult:
    """A smoothed chain at the wanted times: mean (n, 3, m), covariance (n, 3, 3), NaN outside the segments.

    ``drive`` is what ``levels.q`` is scaled by over time, ``streams`` what it was smoothed from, ``wander`` the
    correlated noise that its positions show.
    """

    t: FloatArray
    mean: FloatArray
    covariance: FloatArray
    levels: Levels
    streams: tuple[Stream, ...]
    drive: Drive | None = None
    wander: Wander | None = None


def clean_and_level(
    streams: tuple[Stream, ...], segments: Segments, inputs: Mapping[str, Measurement], rounds: int = ROUNDS
) -> tuple[tuple[Stream, ...], Levels, FloatArray, Drive | None]:
    """Set outliers aside and estimate the noise levels, in turns until the set of outliers stands.

    With no rounds the samples are judged already: only the process intensity, and levels that are not given, are
    estimated. The drive is adapted for the heading only: for the track it gains nothing
    (benchmarks/bench_preprocess.py).
    """
    if rounds:
        streams = tuple(without_jumps(s) for s in streams)
    levels, prior = first_guess(streams)
    cut, bounds = truncation(streams[0].value.shape[1]), bounds_of(streams, segments)
    drive: Drive | None = None
    for k in range(rounds or 2):
        assembled = assemble(streams, segments, np.empty(0), drive)
        levels = chain_levels(streams, assembled, levels, prior, bounds, near=k > 1, rough=k < 2)
        if k < 2:
            drive = find_any_drive(streams, segments, inputs, levels, prior, drive, late=k == 1)
            assembled = assemble(streams, segments, np.empty(0), drive)
            levels = chain_levels(streams, assembled, levels, prior, bounds, rough=rounds == 1)
        if not rounds:
            continue
        cleaned = gate(streams, segments, levels, prior, drive)
        changed = sum(int((a.good != b.good).sum()) for a, b in zip(cleaned, streams, strict=True))
        streams = cleaned
        if k > 0 and changed <= NEGLIGIBLE * sum(len(s.t) for s in streams):
            break
    given = np.array([np.isfinite(s.sigma) for s in streams])
    return streams, replace(levels, sigma=np.where(given, levels.sigma, levels.sigma / cut)), prior, drive


def find_any_drive(
    streams: tuple[Stream, ...],
    segments: Segments,
    inputs: Mapping[str, Measurement],
    levels: Levels,
    prior: FloatArray,
    drive: Drive | None,
    late: bool,
) -> Drive | None:
    """Return the drive that the inputs show; of a heading, when late in the search, else the one it shows itself."""
    drive = commanded_drive(streams, segments, inputs, levels, prior) or drive
    if late and drive is None and streams[0].value.shape[1] == 1:
        return find_drive(streams, assemble(streams, segments, np.empty(0)), levels, prior)
    return drive


def without_jumps(stream: Stream) -> Stream:
    """Set the grossest outliers aside before anything is estimated; they are tried again later."""
    if stream.judged:
        return stream
    jumps = np.zeros(len(stream.t), dtype=bool)
    use = np.flatnonzero(stream.good)
    jumps[use] = sliding_three_sigma(stream.t[use], stream.value[use], k=GROSS, rounds=2)
    return replace(stream, good=stream.good & ~jumps)


def smooth_chain(
    streams: tuple[Stream, ...],
    segments: Segments,
    wanted: FloatArray,
    inputs: Mapping[str, Measurement] | None = None,
    q: float | None = None,
    beside: Segments | None = None,
    rounds: int | None = None,
) -> ChainResult:
    """Smooth one chain at the wanted times; levels that are not given are estimated.

    Parameters
    ----------
    streams : tuple of Stream
    segments : tuple of (start, end)
    wanted : (n,) s
    inputs : mapping of str to Measurement, optional
        When they change, more is expected of the motion.
    q : float, optional
        Process intensity, where known with every stream's ``sigma``: then nothing is estimated or set aside.
    beside : tuple of (start, end), optional
        The segments with samples just outside them, which are judged but not smoothed.
    rounds : int, optional
        Of estimating levels and setting outliers aside, at most (``ROUNDS``); 0: the samples are judged already.
    """
    if q is None:
        streams, levels, prior, drive = clean_and_level(
            streams, beside or segments, inputs or {}, ROUNDS if rounds is None else rounds
        )
    else:
        guess, prior = first_guess(streams)
        levels, drive = replace(guess, q=q), None
    assembled = assemble(streams, segments, wanted, drive)
    rows = at_levels(assembled, levels.sigma)
    smoothed = smooth(rows, levels.q, prior)
    mean, covariance = at_times(assembled, smoothed.mean, smoothed.covariance, wanted)
    return ChainResult(wanted, mean, covariance, levels, streams, drive)


def at_times(
    assembled: Assembled, smoothed: FloatArray, spread: FloatArray, wanted: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of the rows at the wanted times, NaN where no row is."""
    t = assembled.rows.t
    at = np.searchsorted(t, wanted, side="right") - 1
    hit = (at >= 0) & (t[np.maximum(at, 0)] == wanted) if len(t) else np.zeros(len(wanted), bool)
    mean = np.full((len(wanted), *smoothed.shape[1:]), np.nan)
    covariance = np.full((len(wanted), 3, 3), np.nan)
    mean[hit], covariance[hit] = smoothed[at[hit]], spread[at[hit]]
    return mean, covariance


def at_origin(stream: Stream, heading: ChainResult, arm: tuple[float, float]) -> Stream:
    """Positions or earth velocities of a point at ``arm``, moved to the campaign's origin."""
    if arm == (0.0, 0.0):
        return stream
    at = np.clip(np.searchsorted(heading.t, stream.t), 0, len(heading.t) - 1)
    psi, r = heading.mean[at, 0, 0], heading.mean[at, 1, 0]
    move = frames.lever_position(arm, psi) if stream.order == 0 else frames.lever_velocity(arm, psi, r)
    value = stream.value - np.nan_to_num(move)
    return replace(stream, value=value)


def to_earth(stream: Stream, heading: ChainResult) -> Stream:
    """Body velocities turned to north and east by the smoothed heading."""
    at = np.clip(np.searchsorted(heading.t, stream.t), 0, len(heading.t) - 1)
    psi = heading.mean[at, 0, 0]
    known = np.isfinite(psi)
    value = frames.body_to_earth(stream.value, np.nan_to_num(psi))
    return replace(stream, value=value, good=stream.good & known, candidate=stream.candidate & known)


def states(track: ChainResult, heading: ChainResult) -> pd.DataFrame:
    """Position, heading, body velocities, accelerations and the standard deviation of each.

    Surge and sway accelerations are those of the body components: ``du = a_forward + r v``,
    ``dv = a_starboard - r u`` (Fossen 2011, eq. 2.18 differentiated).
    """
    psi, r, dr = (heading.mean[:, k, 0] for k in range(3))
    body = frames.earth_to_body(track.mean[:, 1, :], psi)
    force = frames.earth_to_body(track.mean[:, 2, :], psi)
    u, v = body.T
    out = {
        "t": track.t, "x": track.mean[:, 0, 0], "y": track.mean[:, 0, 1], "psi": psi, "u": u, "v": v, "r": r,
        "du": force[:, 0] + r * v, "dv": force[:, 1] - r * u, "dr": dr,
    }  # fmt: skip
    return pd.DataFrame(out | _sigmas(track.covariance, heading.covariance, out))


def _sigmas(track: FloatArray, heading: FloatArray, s: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """First-order propagation of both chains' covariances to the columns of ``states``."""
    p, rr, psi = track, heading[:, 1, 1], heading[:, 0, 0]
    u, v, r = s["u"], s["v"], s["r"]
    variance = {
        "x": p[:, 0, 0],
        "y": p[:, 0, 0],
        "psi": psi,
        "u": p[:, 1, 1] + v**2 * psi,
        "v": p[:, 1, 1] + u**2 * psi,
        "r": rr,
        "du": p[:, 2, 2] + r**2 * p[:, 1, 1] + v**2 * rr + s["dv"] ** 2 * psi,
        "dv": p[:, 2, 2] + r**2 * p[:, 1, 1] + u**2 * rr + s["du"] ** 2 * psi,
        "dr": heading[:, 2, 2],
    }
    return {f"sigma_{k}": np.sqrt(np.maximum(x, 0.0)) for k, x in variance.items()}
