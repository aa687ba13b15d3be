"""Errors of the heading that wander, told by the gyro: over all logs, whatever model there is.

A compass's errors drift beside their white part (a magnetic field on board, an estimator of attitude that follows
slowly): first-order Gauss-Markov noise. The heading less the integral of the gyro has no motion in it, only what is
wrong with either. What every log has alike (the gyro's scale, the compass's deviation and lag) and what each has of its
own (the gyro's offset) is taken off as far as it goes; a wander is there where what is left is likelier with one
(restricted likelihood; Patterson and Thompson 1971) than as white noise and a gyro whose own noise adds up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

from preprocess.trial import Measurement, Trial

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Shortest block over which errors are averaged, s, and about how many blocks there are in all.
SHORTEST, MOST = 1.0, 500
#: Fewer blocks than this in all tell nothing, and fewer in a piece say nothing of it.
TELLING, LEAST = 40, 6
#: A gyro that is silent for longer than so many of its intervals, and than this, s, begins anew.
SILENT, SILENT_SECONDS = 5.0, 1.0
#: Time constants that are tried, s, the first alone where there is none; gain in -2 log likelihood that is believed,
#: and by which another time constant than the first is.
TIMES, BELIEVED, CLEARER = (40.0, 10.0, 20.0, 80.0, 160.0), 12.0, 4.0
#: A wander of less than this, rad, is as good as none, and a compass of less noise than this as good as exact.
NEGLIGIBLE, EXACT = 1e-3, 1e-6
#: Sizes are sought between these, as logarithms, in units of the white noise of a block.
RANGE = (-5.0, 8.0)
#: So much, as a logarithm, may the gyro's noise add up faster than its samples say: they miss what is between them.
WALKS = (0.0, 1.2)
#: The rate and its slope are taken over so long, s, each way: about as long as a compass may be late.
LATE = 0.5
#: So many times the angle is sought by which a compass deviates.
ANGLES = 3
#: Evaluations of the likelihood in a search, and share of the largest information below which nothing is told.
MOST_EVALUATIONS, UNTOLD = 90, 1e-9


@dataclass(frozen=True)
class HeadingWander:
    """Standard deviation of the heading's drift, rad, its time constant, s, and the gain in -2 log likelihood."""

    size: float
    time: float
    gain: float


class _Run(NamedTuple):
    """Times (n,) of headings that a gyro spans, ``psi``, the gyro's integral at them, its rate and its slope."""

    log: int
    at: FloatArray
    psi: FloatArray
    integral: FloatArray
    rate: FloatArray
    slope: FloatArray
    walk: float


class _Piece(NamedTuple):
    """Averages over blocks: ``t`` (b,), ``value`` (b,) heading less gyro, ``columns`` (b, k), ``samples`` (b,)."""

    log: int
    t: FloatArray
    value: FloatArray
    columns: FloatArray
    samples: FloatArray
    walk: float


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
    along = np.hypot(states["u"], states["v"])
    states["sigma_psi"] = np.hypot(states["sigma_psi"], wander.size)
    states["sigma_v"] = np.hypot(states["sigma_v"], along * wander.size)
    told = replace(heading, wander=wander.size, correlation_time=wander.time)
    size = f"{np.degrees(wander.size):.2g}°, over {wander.time:.0f} s"
    said = f"The errors of the heading wander ({size}): sway is less sure."
    return replace(
        trial,
        states=states,
        measurements={**trial.measurements, "heading": told},
        findings=(*trial.findings, said),
    )


def heading_wander(trials: Sequence[Trial]) -> HeadingWander | None:
    """The wander of the headings against the gyro; None where none shows, or no log has both."""
    both = [t for t in trials if {"heading", "yaw_rate"} <= set(t.measurements)]
    runs = [run for k, t in enumerate(both) for run in _runs(k, t)]
    if not runs:
        return None
    length = max(SHORTEST, sum(run.at[-1] - run.at[0] for run in runs) / MOST)
    angles = zip(runs, _angles(runs), strict=True)
    pieces = [p for run, angle in angles if (p := _piece(run, angle, length))]
    if sum(len(p.t) for p in pieces) < TELLING:
        return None
    pieces = [_with_own(p, len(both)) for p in pieces]
    none, _ = _likeliest(pieces, None)
    first = _likeliest(pieces, TIMES[0])
    if none - first[0] < 0.5 * BELIEVED:
        return None
    tried = {TIMES[0]: first} | {time: _likeliest(pieces, time) for time in TIMES[1:]}
    time = min(tried, key=lambda k: tried[k][0] - CLEARER * (k == TIMES[0]))
    gain, size = none - tried[time][0], tried[time][1]
    return HeadingWander(size, time, gain) if gain >= BELIEVED and size >= NEGLIGIBLE else None


def _runs(log: int, trial: Trial) -> list[_Run]:
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
) -> _Run:
    inside = heading.good & (heading.t >= max(t[0], span[0])) & (heading.t <= min(t[-1], span[1]))
    at, psi = heading.t[inside], heading.value[inside]
    turned = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (r[1:] + r[:-1]))])
    walk = float(np.median(np.diff(t))) * (gyro.sigma / max(heading.sigma, EXACT)) ** 2
    before, now, after = (np.interp(at + shift, t, turned) for shift in (-LATE, 0.0, LATE))
    rate, slope = 0.5 * (after - before) / LATE, (after - 2.0 * now + before) / LATE**2
    return _Run(log, at, psi, now, rate, slope, walk)


def _angles(runs: Sequence[_Run]) -> list[FloatArray]:
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


def _alike(run: _Run, angle: FloatArray) -> FloatArray:
    """What every log has alike (n, 11), for an angle (n,): the gyro's scale, a lag, deviation once and twice around."""
    around = np.column_stack([f(k * angle) for k in (1.0, 2.0) for f in (np.sin, np.cos)])
    return np.column_stack([run.integral, run.rate, run.slope, around, run.rate[:, None] * around])


def _piece(run: _Run, angle: FloatArray, length: float) -> _Piece | None:
    """What is left of heading and gyro in blocks of about ``length`` s; None of too few."""
    _, where, count = np.unique((run.at - run.at[0]) // length, return_inverse=True, return_counts=True)
    if len(count) < LEAST:
        return None
    mean = [np.bincount(where, c) / count for c in (run.at, run.psi - run.integral, *_alike(run, angle).T)]
    return _Piece(run.log, mean[0], mean[1], np.column_stack(mean[2:]), count.astype(float), run.walk)


def _with_own(piece: _Piece, logs: int) -> _Piece:
    """The piece with a drift of the gyro in its own log alone."""
    offset = np.zeros((len(piece.t), logs))
    offset[:, piece.log] = piece.t - piece.t.mean()
    return piece._replace(columns=np.column_stack([piece.columns, offset]))


def _likeliest(pieces: Sequence[_Piece], time: float | None) -> tuple[float, float]:
    """Least -2 log likelihood over the gyro's noises and a wander of the heading with a ``time``; and its size.

    Sizes are counted in the white noise of a block: what the gyro's rate does in a piece, and the heading at any time;
    what the gyro's own noise adds up to, in what it is taken for.
    """
    unit = [_unit(p, time) for p in pieces]
    block = 1.0 / float(np.median(np.concatenate([p.samples for p in pieces])))
    lasts = float(np.median([p.t[-1] - p.t[0] for p in pieces]))
    few = 2 + (time is not None)
    scales = np.array([1.0, 3.0 * block / lasts**3, block])[:few]

    def objective(x: FloatArray) -> float:
        return _deviance(pieces, unit, scales * np.exp(2.0 * x))[0]

    begin, step = np.array([0.2, -1.0, 1.0])[:few], np.array([0.5, 1.5, 1.0])[:few]
    options = {"initial_simplex": np.vstack([begin, begin + np.diag(step)]),
               "xatol": 0.05, "fatol": 0.05, "maxfev": MOST_EVALUATIONS}  # fmt: skip
    bounds = [WALKS, RANGE, RANGE][:few]
    best = minimize(objective, begin, method="Nelder-Mead", bounds=bounds, options=options)  # type: ignore[call-overload]
    _, noise = _deviance(pieces, unit, scales * np.exp(2.0 * best.x))
    return float(best.fun), float(np.sqrt(noise * block) * np.exp(best.x[-1])) if time is not None else 0.0


def _unit(piece: _Piece, time: float | None) -> FloatArray:
    """Covariances (k, b, b): white noise of unit size, the gyro's that adds up, its rate's walk, and a wander."""
    at = piece.t - piece.t[0]
    first, last = np.minimum.outer(at, at), np.maximum.outer(at, at)
    parts = [np.diag(1.0 / piece.samples), piece.walk * first, first**2 * (3.0 * last - first) / 6.0]
    if time is not None:
        parts.append(np.exp(-(last - first) / time))
    return np.array(parts)


def _deviance(pieces: Sequence[_Piece], unit: Sequence[FloatArray], sizes: FloatArray) -> tuple[float, float]:
    """-2 log restricted likelihood with variances of these ``sizes`` over white noise's, at its likeliest; and that.

    Each piece has an angle of its own.
    """
    logs, gram = 0.0, np.zeros(2 * (pieces[0].columns.shape[1] + 1,))
    for p, parts in zip(pieces, unit, strict=True):
        lower = np.linalg.cholesky(parts[0] + np.einsum("k,kij->ij", sizes, parts[1:]))
        columns = np.column_stack([np.ones(len(p.t)), p.columns, p.value])
        right = solve_triangular(lower, columns, lower=True, check_finite=False)
        products = right.T @ right
        logs += 2.0 * np.log(np.diag(lower)).sum() + np.log(products[0, 0])
        gram = gram + products[1:, 1:] - np.outer(products[1:, 0], products[0, 1:]) / products[0, 0]
    information, score = gram[:-1, :-1], gram[:-1, -1]
    root = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    information, score = information * root * root[:, None], score * root
    values, vectors = np.linalg.eigh(information)
    shown = values > UNTOLD * values[-1]
    reached = (vectors[:, shown].T @ score) ** 2 / values[shown]
    free = sum(len(p.t) - 1 for p in pieces) - int(shown.sum())
    noise = max(float(gram[-1, -1] - reached.sum()) / free, EXACT**2)
    return float(logs + np.log(values[shown]).sum() - 2.0 * np.log(root).sum() + free * np.log(noise)), noise
