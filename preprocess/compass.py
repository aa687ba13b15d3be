"""Errors of the heading that wander, told by the gyro: over all logs, whatever model there is.

A compass's errors drift beside their white part: over minutes (a magnetic field on board) or within seconds (an
estimator of attitude that filters). Both are first-order Gauss-Markov noise. The heading less the integral of the gyro
has no motion in it (``preprocess.against_gyro``); a wander is there where what is left is likelier with one than as
white noise and a gyro whose own noise adds up (``preprocess.wander_likelihood``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from preprocess.against_gyro import EXACT, Piece, Run, angles_of, piece_of, runs_of, with_own
from preprocess.trial import FloatArray, Trial
from preprocess.wander_likelihood import Likeliest, likeliest

#: Shortest block over which errors are averaged, s, and about how many blocks there are in all.
SHORTEST, MOST = 1.0, 500
#: Fewer blocks than this in all tell nothing.
TELLING = 40
#: Time constants that are tried, s, the first alone where there is none; gain in -2 log likelihood that is believed,
#: and by which another time constant than the first is.
TIMES, BELIEVED, CLEARER = (40.0, 10.0, 20.0, 80.0, 160.0), 12.0, 4.0
#: A wander of less than this, rad, is as good as none.
NEGLIGIBLE = 1e-3
#: Within seconds: shortest block, s, or the heading's own interval; time constants in blocks, the first as above.
QUICKEST, QUICK = 0.1, (8.0, 2.0, 4.0, 16.0, 32.0)
#: ... of sections of so many blocks, so many of them all over the logs.
SECTION, SECTIONS = 120, 10
#: ... of headings and a gyro that come in no more than this, s.
OFTEN = 0.5


@dataclass(frozen=True)
class HeadingWander:
    """Standard deviation of the heading's drift, rad, its time constant, s, and the gain in -2 log likelihood.

    ``white`` is the white noise beside it, rad; None where the drift is slow enough to be none of what was estimated.
    """

    size: float
    time: float
    gain: float
    white: float | None = None


def with_heading_wander(trials: Sequence[Trial]) -> list[Trial]:
    """The trials with the wander of their headings, where they show one, in the headings and in what follows from them.

    A smoothed heading has followed the wander: it and the sway, to which a vessel under way turns it, are less sure.
    """
    found = heading_wander(trials)
    return list(trials) if found is None else [_less_sure(t, found) for t in trials]


def _less_sure(trial: Trial, wander: HeadingWander) -> Trial:
    heading = trial.measurements.get("heading")
    if heading is None:
        return trial
    states = trial.states.copy()
    along, more = np.hypot(states["u"], states["v"]), _followed(trial, wander)
    states["sigma_psi"] = np.hypot(states["sigma_psi"], more)
    states["sigma_v"] = np.hypot(states["sigma_v"], along * more)
    white = heading.sigma if wander.white is None else min(heading.sigma, wander.white)
    told = replace(heading, wander=wander.size, correlation_time=wander.time, sigma=white)
    said = f"The errors of the heading wander ({words_of(wander)}): sway is less sure."
    return replace(
        trial,
        states=states,
        measurements={**trial.measurements, "heading": told},
        findings=(*trial.findings, said),
    )


def words_of(wander: HeadingWander) -> str:
    """Size and time constant, as a finding has them."""
    return f"{np.degrees(wander.size):.2g}°, over {wander.time:.{0 if wander.time >= 10.0 else 1}f} s"


def _followed(trial: Trial, wander: HeadingWander) -> FloatArray:
    """Standard deviation (n,) by which a smoothed heading follows a wander.

    All of it, or what so many times the noise makes of what was taken for white: a smoother averages what is quick.
    """
    heading = trial.measurements["heading"]
    every = float(np.median(np.diff(heading.t[heading.good])))
    times = 2.0 * wander.size**2 * wander.time / (max(heading.sigma, EXACT) ** 2 * every)
    sigma = trial.states["sigma_psi"].to_numpy(dtype=float)
    return np.asarray(np.minimum(wander.size, np.sqrt(times) * sigma), dtype=float)


def heading_wander(trials: Sequence[Trial]) -> HeadingWander | None:
    """The wander of the headings against the gyro; None where none shows, or no log has both."""
    both = [t for t in trials if {"heading", "yaw_rate"} <= set(t.measurements)]
    runs = [run for k, t in enumerate(both) for run in runs_of(k, t)]
    if not runs:
        return None
    angles = angles_of(runs)
    slow = _told(_slow_pieces(runs, angles, len(both)), TIMES)
    if slow is not None:
        return replace(slow, white=None)
    block = _quickest(both)
    if block > OFTEN:
        return None
    return _told(_quick_pieces(runs, angles, len(both), block), [block * k for k in QUICK])


def _quickest(trials: Sequence[Trial]) -> float:
    """Length of the blocks in which a quick wander shows, s."""
    every = [float(np.median(np.diff(t.measurements[k].t))) for t in trials for k in ("heading", "yaw_rate")]
    return max(QUICKEST, *every)


def _slow_pieces(runs: Sequence[Run], angles: Sequence[FloatArray], logs: int) -> list[Piece]:
    """Whole runs in long blocks."""
    length = max(SHORTEST, sum(run.at[-1] - run.at[0] for run in runs) / MOST)
    each = [piece_of(run, angle, length) for run, angle in zip(runs, angles, strict=True)]
    return [with_own(p, logs) for p in each if p]


def _quick_pieces(runs: Sequence[Run], angles: Sequence[FloatArray], logs: int, block: float) -> list[Piece]:
    """Some sections of the runs in short blocks."""
    each = [
        s for run, angle in zip(runs, angles, strict=True) for s in _sections(run, angle, block * SECTION)
    ]
    some = each[:: -(-len(each) // SECTIONS)] if each else []
    pieces = [piece_of(run, angle, block) for run, angle in some]
    return [with_own(p, logs) for p in pieces if p]


def _sections(run: Run, angle: FloatArray, length: float) -> list[tuple[Run, FloatArray]]:
    """A run, and its angle (n,), in sections of this length, s."""
    count = int((run.at[-1] - run.at[0]) // length)
    edges = np.searchsorted(run.at, run.at[0] + length * np.arange(count + 1))
    return [(run.over(slice(a, b)), angle[a:b]) for a, b in pairwise(edges)]


def _told(pieces: Sequence[Piece], times: Sequence[float]) -> HeadingWander | None:
    """The likeliest wander of these time constants, s; None where there is none to be believed."""
    if sum(len(p.t) for p in pieces) < TELLING:
        return None
    none = likeliest(pieces, None).deviance
    first = likeliest(pieces, times[0])
    if none - first.deviance < 0.5 * BELIEVED:
        return None
    tried: dict[float, Likeliest] = {times[0]: first} | {time: likeliest(pieces, time) for time in times[1:]}
    time = min(tried, key=lambda k: tried[k].deviance - CLEARER * (k == times[0]))
    found, gain = tried[time], none - tried[time].deviance
    return (
        HeadingWander(found.size, time, gain, found.white)
        if gain >= BELIEVED and found.size >= NEGLIGIBLE
        else None
    )
