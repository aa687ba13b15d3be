"""What a heading says less what the gyro says: no motion is in it, only what is wrong with either.

What every log has alike (the gyro's scale, the compass's deviation and lag) and what each has of its own (the gyro's
offset) stand beside it as columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from preprocess.trial import FloatArray, Measurement, Trial

#: Fewer blocks than this in a piece say nothing of it, nor do fewer samples of the gyro.
LEAST = 6
#: A gyro that is silent for longer than so many of its intervals, and than this, s, begins anew.
SILENT, SILENT_SECONDS = 5.0, 1.0
#: The rate and its slope are taken over so long, s, each way: about as long as a compass may be late.
LATE = 0.5
#: So many times the angle is sought by which a compass deviates.
ANGLES = 3
#: A compass of less noise than this, rad, is as good as exact; share of the largest information below which nothing is
#: told.
EXACT, UNTOLD = 1e-6, 1e-9


class Run(NamedTuple):
    """Times (n,) of headings that a gyro spans, ``psi``, the gyro's integral at them, its rate and its slope."""

    log: int
    at: FloatArray
    psi: FloatArray
    integral: FloatArray
    rate: FloatArray
    slope: FloatArray
    walk: float

    def over(self, part: slice) -> Run:
        """Part of the run."""
        at, psi, integral = self.at[part], self.psi[part], self.integral[part]
        return Run(self.log, at, psi, integral, self.rate[part], self.slope[part], self.walk)


class Piece(NamedTuple):
    """Averages over blocks: ``t`` (b,), ``value`` (b,) heading less gyro, ``columns`` (b, k), ``samples`` (b,)."""

    log: int
    t: FloatArray
    value: FloatArray
    columns: FloatArray
    samples: FloatArray
    walk: float


def runs_of(log: int, trial: Trial) -> list[Run]:
    """What of a log a gyro spans that is never silent for long."""
    heading, gyro = trial.measurements["heading"], trial.measurements["yaw_rate"]
    t, r = gyro.t[gyro.good], gyro.value[gyro.good]
    if len(t) < LEAST:
        return []
    longest = max(SILENT * float(np.median(np.diff(t))), SILENT_SECONDS)
    edges = [0, *(np.nonzero(np.diff(t) > longest)[0] + 1), len(t)]
    found = [
        _run(log, heading, gyro, t[a:b], r[a:b], span)
        for a, b in pairwise(edges) for span in trial.segments if b - a >= LEAST
    ]  # fmt: skip
    return [run for run in found if len(run.at) >= LEAST]


def _run(
    log: int, heading: Measurement, gyro: Measurement, t: FloatArray, r: FloatArray, span: tuple[float, float]
) -> Run:
    inside = heading.good & (heading.t >= max(t[0], span[0])) & (heading.t <= min(t[-1], span[1]))
    at, psi = heading.t[inside], heading.value[inside]
    turned = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (r[1:] + r[:-1]))])
    walk = float(np.median(np.diff(t))) * (gyro.sigma / max(heading.sigma, EXACT)) ** 2
    before, now, after = (np.interp(at + shift, t, turned) for shift in (-LATE, 0.0, LATE))
    rate, slope = 0.5 * (after - before) / LATE, (after - 2.0 * now + before) / LATE**2
    return Run(log, at, psi, now, rate, slope, walk)


def angles_of(runs: Sequence[Run]) -> list[FloatArray]:
    """The heading (n,) of each run as the gyro tells it: its integral, begun where a compass that deviates says.

    By a heading's own angle a compass would deviate by what it wanders.
    """
    angles = [run.psi for run in runs]
    against = [run.psi - run.integral for run in runs]
    for _ in range(ANGLES):
        around = [_alike(r, a) for r, a in zip(runs, angles, strict=True)]
        bare = [_bare(r.at, np.column_stack([c, a])) for r, c, a in zip(runs, around, against, strict=True)]
        columns = np.concatenate(bare)
        alike = np.linalg.lstsq(columns[:, :-1], columns[:, -1], rcond=UNTOLD)[0]
        left = [a - c @ alike for c, a in zip(around, against, strict=True)]
        angles = [
            (1.0 + alike[0]) * r.integral + rest - _bare(r.at, rest)
            for r, rest in zip(runs, left, strict=True)
        ]
    return angles


def _bare(at: FloatArray, values: FloatArray) -> FloatArray:
    """Values (n, ...) less the straight line in time that is nearest to them."""
    line = np.column_stack([np.ones(len(at)), at - at.mean()])
    return np.asarray(values - line @ np.linalg.lstsq(line, values, rcond=None)[0], dtype=float)


def _alike(run: Run, angle: FloatArray) -> FloatArray:
    """What every log has alike (n, 11), for an angle (n,): the gyro's scale, a lag, deviation once and twice around."""
    around = np.column_stack([f(k * angle) for k in (1.0, 2.0) for f in (np.sin, np.cos)])
    return np.column_stack([run.integral, run.rate, run.slope, around, run.rate[:, None] * around])


def piece_of(run: Run, angle: FloatArray, length: float) -> Piece | None:
    """What is left of heading and gyro in blocks of about ``length`` s; None of too few."""
    _, where, count = np.unique((run.at - run.at[0]) // length, return_inverse=True, return_counts=True)
    if len(count) < LEAST:
        return None
    mean = [np.bincount(where, c) / count for c in (run.at, run.psi - run.integral, *_alike(run, angle).T)]
    return Piece(run.log, mean[0], mean[1], np.column_stack(mean[2:]), count.astype(float), run.walk)


def with_own(piece: Piece, logs: int) -> Piece:
    """The piece with a drift of the gyro in its own log alone."""
    offset = np.zeros((len(piece.t), logs))
    offset[:, piece.log] = piece.t - piece.t.mean()
    return piece._replace(columns=np.column_stack([piece.columns, offset]))
