"""Errors of headings and gyros that wander or go with the heading, told by each other, whatever model there is.

A compass's errors drift beside their white part: over minutes (a magnetic field on board) or within seconds (an
estimator of attitude that filters). A gyro's do as well: its zero moves, and what vibrates is filtered. Both are
first-order Gauss-Markov noise. The heading less the integral of the gyro has no motion in it
(``preprocess.against_gyro``); what wanders is what makes that likelier (``preprocess.told_wanders``).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from preprocess.against_gyro import DEVIATION, alike_of, angles_of, lag_of
from preprocess.chains import Segments
from preprocess.deviation import Deviation, deviation_of, without_deviation
from preprocess.integrated import Piece, Run, Sensed, in_long_blocks, piece_of, runs_of, sensed, with_own
from preprocess.less_sure import with_wanders
from preprocess.told_wanders import OWN, Smooth, Told, told, told_quick
from preprocess.trial import FloatArray, Trial

#: How headings wander smoothly, over minutes; gyros drift as readily.
COMPASSES = Smooth((40.0, 80.0, 160.0), 0.05, 0.5)
#: A wander of the heading of less than this, rad, is as good as none.
NEGLIGIBLE = 1e-3
#: Within seconds: shortest block, s, or the heading's own interval, none longer than the second; time constants in
#: blocks, the first alone where there is none.
QUICKEST, SLOWEST, QUICK = 0.1, 0.5, (8.0, 2.0, 4.0, 16.0, 32.0)
#: ... of sections of so many blocks, so many of them all over the logs.
SECTION, SECTIONS = 120, 10
#: Headings are stamped anew that are late by more than this, s, so many times at the most.
LATE, SHIFTS = 0.1, 4


def with_heading_wander(trials: Sequence[Trial]) -> list[Trial]:
    """The trials with the wanders of headings and yaw rates, where they show one, and what follows from them less sure.

    A smoothed heading has followed the wander: it and the sway, to which a vessel under way turns it, are less sure.
    What the compass deviates by is taken off.
    """
    found, deviation = turning_errors(trials)
    freed = (without_deviation(t, deviation) for t in trials)
    return [with_wanders(t, {"heading": found.own, "yaw_rate": found.rate}) for t in freed]


def turning_errors(trials: Sequence[Trial]) -> tuple[Told, Deviation | None]:
    """The wander of the headings and that of the gyro, by each other, and what the compass deviates by.

    None where none shows, or no log has both.
    """
    both = [t for t in trials if {"heading", "yaw_rate"} <= set(t.measurements)]
    headings, gyros = ([sensed(t.measurements[k]) for t in both] for k in ("heading", "yaw_rate"))
    runs = _timed(headings, gyros, [t.segments for t in both])
    if not runs:
        return Told(), None
    columns = [alike_of(run, angle) for run, angle in zip(runs, angles_of(runs), strict=True)]
    whole = in_long_blocks(runs, columns, len(both))
    found = told(whole, gyros, COMPASSES)
    deviation = deviation_of(whole, DEVIATION, found, max(g.missed for g in gyros)) if whole else None
    own, block = found.own, max(QUICKEST, *(s.every for s in (*headings, *gyros)))
    if (own is None or own.time == min(OWN)) and block <= SLOWEST:
        pieces = _in_short_blocks(runs, columns, len(both), block)
        slow = [own.time] if own else []
        quick = told_quick(pieces, [*(block * k for k in QUICK), *slow], found.rate)
        own = quick if quick and quick.time not in slow else own
    return Told(own if own and own.size >= NEGLIGIBLE else None, found.rate), deviation


def _timed(headings: Sequence[Sensed], gyros: Sequence[Sensed], segments: Sequence[Segments]) -> list[Run]:
    """Headings against gyros, once the one is stamped as the other is to within ``LATE``.

    What is late by much has more of the motion in it than its rate and the slope of that.
    """
    lag = 0.0
    for _ in range(SHIFTS):
        timed = [h._replace(t=h.t - lag) for h in headings]
        each = zip(timed, gyros, segments, strict=True)
        runs = [r for k, (heading, gyro, spans) in enumerate(each) for r in runs_of(k, heading, gyro, spans)]
        late = lag_of(runs) if runs else 0.0
        if not abs(late) > LATE:
            break
        lag += late
    return runs


def _in_short_blocks(
    runs: Sequence[Run], columns: Sequence[FloatArray], logs: int, block: float
) -> list[Piece]:
    """Some sections of the runs in short blocks."""
    each = [s for run, c in zip(runs, columns, strict=True) for s in _sections(run, c, block * SECTION)]
    some = each[:: -(-len(each) // SECTIONS)] if each else []
    pieces = [piece_of(run, c, block) for run, c in some]
    return [with_own(p, logs) for p in pieces if p]


def _sections(run: Run, columns: FloatArray, length: float) -> list[tuple[Run, FloatArray]]:
    """A run, and its columns (n, k), in sections of this length, s."""
    count = int((run.at[-1] - run.at[0]) // length)
    edges = np.searchsorted(run.at, run.at[0] + length * np.arange(count + 1))
    return [(run.over(slice(a, b)), columns[a:b]) for a, b in pairwise(edges)]
