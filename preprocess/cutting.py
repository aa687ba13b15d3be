"""One file of an afternoon becomes trials: a long log is cut where one manoeuvre ends and the next begins.

Short logs are one manoeuvre and stay whole; so do logs that the campaign names or slices itself. What lies idle (at
the quay, inputs at rest) is a part of its own without segments, in any log: nothing is fitted to it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from preprocess.chains import Segments
from preprocess.gaps import LEAST_SECONDS
from preprocess.manoeuvres import Found, angles_in, classify_stretch, gridded, idle_speed
from preprocess.trial import BoolArray, FloatArray, Measurement, Step, Trial

#: Logs under way for longer than this are cut at manoeuvres, s; lying idle for longer than this is a part of its own.
LONG, IDLE = 600.0, 60.0
#: What a vessel does just before and after it lies idle belongs to what it does then, s.
MARGIN = 5.0
#: A straight run keeps its heading within this, rad, for so many lengths at its speed, and s at least.
STRAIGHT, LENGTHS, LEAST = np.radians(5.0), 25.0, 20.0
#: A turn to one side by more than this is a circle, rad; smaller ones back do not end it, rad.
CIRCLE, BACK = np.radians(270.0), np.radians(4.0)
#: Inputs that move by less than this share of their range are at rest.
AT_REST = 0.05


@dataclass(frozen=True)
class _Part:
    """Part of a log, s."""

    start: float
    end: float
    idle: bool = False


def cut_at_manoeuvres(trial: Trial) -> tuple[Trial, ...]:
    """Cut a trial into its manoeuvres, in order; itself alone where it is one.

    Parameters
    ----------
    trial : Trial
        Of a whole log, or of the part of a log that has one role.
    """
    parts = [p for segment in trial.segments for p in _parts_of(trial, segment)]
    under_way = [p for p in parts if not p.idle]
    if not under_way or len(under_way) == len(parts) == len(trial.segments):
        return (trial,)
    return tuple(_part(trial, p, parts) for p in parts)


def _parts_of(trial: Trial, segment: tuple[float, float]) -> list[_Part]:
    inside = trial.states["t"].between(*segment)
    step = max(1.0 if segment[1] - segment[0] > LONG else 0.25, (segment[1] - segment[0]) / 50_000.0)
    s = gridded(trial.states[inside], trial.inputs, step)
    if s is None:
        return [_Part(*segment)]
    speed = s.speed + 0.5 * trial.vessel.length * np.abs(s.r)
    slow = _to_the_ends(speed < idle_speed(trial.vessel.length), s.t)
    idle = long_runs(slow & ~_acting(trial, s.t), s.t, IDLE)
    out: list[_Part] = []
    for low, high, rests in _runs(s.t, _eroded(idle, s.t, MARGIN)):
        here = (s.t >= low) & (s.t <= high)
        if rests or high - low < LONG:
            out.append(_Part(low, high, rests))
        else:
            out += _manoeuvres(s.t[here], s.psi[here], s.speed[here], trial.vessel.length)
    out[0] = replace(out[0], start=segment[0])
    out[-1] = replace(out[-1], end=segment[1])
    return out


def _to_the_ends(flag: BoolArray, t: FloatArray) -> BoolArray:
    """Runs of ``flag`` taken on to both ends where less than the margin is missing: speeds are least known there."""
    out = flag.copy()
    for low, high, value in _runs(t, flag):
        if not value and high - low < MARGIN and (low == t[0] or high == t[-1]):
            out |= (t >= low) & (t <= high)
    return out


def _acting(trial: Trial, t: FloatArray) -> BoolArray:
    """Whether an input is moved around each time, (n,) bool."""
    acts = np.zeros(len(t), dtype=bool)
    for m in trial.inputs.values():
        value = m.value[m.good]
        if len(value) > 2 and np.ptp(value) > 0.0:
            moves = m.t[m.good][1:][np.abs(np.diff(value)) > AT_REST * np.ptp(value)]
            at = np.searchsorted(moves, t)
            before = t - moves[np.maximum(at - 1, 0)] if len(moves) else np.full(len(t), np.inf)
            acts |= (at > 0) & (before < MARGIN)
    return acts


def long_runs(flag: BoolArray, t: FloatArray, least: float) -> BoolArray:
    """Only those runs of ``flag`` that last for ``least`` seconds."""
    out = np.zeros(len(flag), dtype=bool)
    for low, high, value in _runs(t, flag):
        if value and high - low >= least:
            out |= (t >= low) & (t <= high) & flag
    return out


def _eroded(flag: BoolArray, t: FloatArray, by: float) -> BoolArray:
    """Runs of ``flag`` without their first and last seconds, except at the ends of all."""
    out = flag.copy()
    for low, high, value in _runs(t, flag):
        if value and low > t[0]:
            out &= ~((t >= low) & (t < low + by))
        if value and high < t[-1]:
            out &= ~((t <= high) & (t > high - by))
    return out


def _runs(t: FloatArray, flag: BoolArray) -> list[tuple[float, float, bool]]:
    """Start, end and value of each run of equal flags; a run ends where the next begins."""
    edges = np.r_[0, np.flatnonzero(np.diff(flag.astype(int))) + 1]
    ends = np.r_[t[edges[1:]], t[-1]]
    return [(float(t[a]), float(b), bool(flag[a])) for a, b in zip(edges, ends, strict=True)]


def _manoeuvres(t: FloatArray, psi: FloatArray, speed: FloatArray, length: float) -> list[_Part]:
    """Straight runs, circles, and what lies between them."""
    least = max(LEAST, LENGTHS * length / max(float(np.median(speed)), 0.05))
    straight = straight_runs(t, psi, least)
    borders = [b for b, _, _ in _runs(t, straight)]
    for low, high, steady in _runs(t, straight):
        if not steady:
            here = (t >= low) & (t <= high)
            borders += circle_borders(t[here], psi[here])
    return _merged(np.unique([*borders, t[-1]]), least)


def _merged(borders: FloatArray, least: float) -> list[_Part]:
    """Parts between borders, those that are too short joined to the one before."""
    kept = [borders[0]]
    for b in borders[1:-1]:
        if b - kept[-1] >= least and borders[-1] - b >= least:
            kept.append(b)
    ends = [*kept[1:], borders[-1]]
    return [_Part(float(a), float(b)) for a, b in zip(kept, ends, strict=True)]


def straight_runs(t: FloatArray, psi: FloatArray, least: float) -> BoolArray:
    """Which times lie within a window of ``least`` seconds in which the heading stays; (n,) bool."""
    from scipy.ndimage import binary_dilation, maximum_filter1d, minimum_filter1d

    width = max(3, round(least / max(float(t[1] - t[0]), 1e-6)) | 1)
    if len(t) < width:
        return np.zeros(len(t), dtype=bool)
    steady = maximum_filter1d(psi, width) - minimum_filter1d(psi, width) < STRAIGHT
    steady[: width // 2] = steady[-(width // 2) :] = False
    return np.asarray(binary_dilation(steady, np.ones(width, dtype=np.bool_)), dtype=np.bool_)


def circle_borders(t: FloatArray, psi: FloatArray) -> list[float]:
    """Times at which turns of more than ``CIRCLE`` to one side begin and end."""
    at = [0, *turning_points(psi, BACK), len(psi) - 1]
    out: list[float] = []
    for a, b in itertools.pairwise(at):
        if abs(psi[b] - psi[a]) > CIRCLE:
            out += [float(t[a]), float(t[b])]
    return out


def turning_points(psi: FloatArray, least: float) -> list[int]:
    """Indices of the extremes from which the heading went back by more than ``least``."""
    out: list[int] = []
    low = high = 0
    rising = 0
    for i, x in enumerate(psi.tolist()):
        low, high = (i if x < psi[low] else low), (i if x > psi[high] else high)
        if rising >= 0 and psi[high] - x > least:
            out += [high] * rising
            rising, low = -1, i
        elif rising <= 0 and x - psi[low] > least:
            out += [low] * -rising
            rising, high = 1, i
    return out


def _part(trial: Trial, part: _Part, parts: Sequence[_Part]) -> Trial:
    """One part of a trial: its rows, its samples (inputs whole: they act on), and its manoeuvre."""
    last = part is parts[-1]
    states = trial.states[_within(trial.states["t"].to_numpy(), part, part is parts[0], last)]
    found = [Found("idle", part.start, part.end)] if part.idle else _named(trial, part)
    segments = () if part.idle else _clipped(trial.segments, part)
    step = Step("cut", {"start": part.start, "end": part.end, "manoeuvre": found[0].kind if found else None})
    return replace(
        trial,
        states=states.reset_index(drop=True),
        measurements={k: _samples(m, part, part is parts[0], last) for k, m in trial.measurements.items()},
        segments=segments,
        manoeuvre=max(found, key=lambda f: f.end - f.start).kind if found else None,
        findings=trial.findings if part is parts[0] else (),
        history=(*trial.history, step),
    )


def _named(trial: Trial, part: _Part) -> list[Found]:
    return classify_stretch(
        trial.states[trial.states["t"].between(part.start, part.end)],
        trial.inputs,
        trial.vessel.length,
        angles_in(trial.inputs_declared),
    )


def _within(t: FloatArray, part: _Part, first: bool, last: bool) -> BoolArray:
    """Times of a part; the first also has what lies before it, the last what lies after."""
    return np.asarray(((t >= part.start) | first) & ((t < part.end) | last), bool)


def _samples(m: Measurement, part: _Part, first: bool, last: bool) -> Measurement:
    keep = _within(m.t, part, first, last)
    weight = None if m.weight is None else m.weight[keep]
    return replace(m, t=m.t[keep], value=m.value[keep], good=m.good[keep], weight=weight)


def _clipped(segments: Segments, part: _Part) -> Segments:
    both = [(max(a, part.start), min(b, part.end)) for a, b in segments]
    return tuple(s for s in both if s[1] - s[0] >= LEAST_SECONDS)
