"""Where an input is silent for so long that nobody knows what it did: no prediction goes on across that.

How much is missed in a silence is said by others of that length elsewhere in the logs, whose ends differ by as much:
how far what was logged between strays from the line (or the step) between its ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from identify.on_change import changes, sampled_evenly
from identify.slowness import slower
from preprocess.chains import Segments
from preprocess.gaps import intersect
from preprocess.trial import Measurement, Trial

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A silence is so many of the input's usual intervals long, and so many s of a small vessel.
INTERVALS, LEAST = 3.0, 1.0
#: What is missed matters from this share of the input's own deviation over a second of a small vessel.
MATERIAL = 0.1
#: Silences are held against others of the same length to within this ratio.
AS_LONG = 1.25
#: They are held against others at so many places of each log, and those whose ends differ as much to within this
#: share of the range, if there are so many; nine in ten of these miss less than is counted.
PLACES, ALIKE, ENOUGH, MOSTLY = 500, 0.1, 20, 0.9
#: What was ordered in a silence may act so many s of a small vessel after it, where an actuator is late or slow.
AFTERWARDS = 1.0
#: Of a log's silences the longest count, one in so many s of a small vessel: what pauses more often is sampled so.
SELDOM = 15.0


def known_inputs_alone(trials: Sequence[Trial]) -> tuple[list[Trial], tuple[str, ...]]:
    """The trials with their segments ended where an input falls silent for long, and what is to be said of that."""
    found: list[list[tuple[float, float]]] = [[] for _ in trials]
    for name in sampled_evenly(trials):
        logs = [t.inputs[name] for t in trials]
        if changes(logs):
            for of_one, silences in zip(found, _silences(logs, trials), strict=True):
                of_one += silences
    joined = [_joined(silences) for silences in found]
    cut = [
        replace(t, segments=_without(t.segments, s)) if s else t for t, s in zip(trials, joined, strict=True)
    ]
    return cut, tuple(_said(t, s) for t, s in zip(trials, joined, strict=True) if s)


def _joined(silences: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Silences of several inputs, those that overlap as one."""
    out: list[tuple[float, float]] = []
    for begin, end in sorted(silences):
        if out and begin < out[-1][1]:
            out[-1] = (out[-1][0], max(out[-1][1], end))
        else:
            out.append((begin, end))
    return out


def _said(trial: Trial, silences: Sequence[tuple[float, float]]) -> str:
    longest = max(b - a for a, b in silences) - AFTERWARDS * slower(trial.vessel.length)
    return (
        f"{trial.name}: an input is silent for up to {longest:.2g} s at {len(silences)} "
        f"{'place' if len(silences) == 1 else 'places'}, where it may have changed: predictions begin anew after it."
    )


def _silences(logs: Sequence[Measurement], trials: Sequence[Trial]) -> list[list[tuple[float, float]]]:
    """Where one input is silent in each of its logs, and may have done what matters."""
    patience = slower(trials[0].vessel.length)
    values = np.concatenate([m.value[m.good] for m in logs])
    material, span = MATERIAL * patience * float(np.std(values)), float(np.ptp(values))
    alike = lru_cache(maxsize=None)(lambda k: _alike(logs, AS_LONG**k))
    return [
        [
            (a, b + AFTERWARDS * patience)
            for a, b, step in _long_ones(m, trial, patience)
            if _missed(*alike(math.ceil(math.log(b - a, AS_LONG))), step, span) > material
        ]
        for m, trial in zip(logs, trials, strict=True)
    ]


def _long_ones(m: Measurement, trial: Trial, patience: float) -> list[tuple[float, float, float]]:
    """Begin, end and change of an input's long silences in a log, the longest; NaN of the change at the log's ends."""
    t, value = m.t[m.good], m.value[m.good]
    if not trial.segments or not len(t):
        return []
    begin, end = trial.segments[0][0], trial.segments[-1][1]
    begins, ends = np.r_[min(begin, t[0]), t], np.r_[t, max(end, t[-1])]
    steps = np.r_[np.nan, np.diff(value), np.nan]
    asked = np.flatnonzero(ends - begins > max(INTERVALS * m.sample_time, LEAST * patience))
    most = math.ceil(sum(b - a for a, b in trial.segments) / (SELDOM * patience))
    longest = sorted(asked, key=lambda k: begins[k] - ends[k])[:most]
    return [(float(begins[k]), float(ends[k]), float(steps[k])) for k in sorted(longest)]


def _missed(steps: FloatArray, missed: FloatArray, step: float, span: float) -> float:
    """What the ends of a silence miss of an input's integral, mostly, by others whose ends differ as much (or NaN)."""
    if not len(missed):
        return np.inf
    alike = np.abs(np.abs(steps) - abs(step)) <= ALIKE * span
    return float(np.quantile(missed[alike] if alike.sum() >= ENOUGH else missed, MOSTLY))


def _alike(logs: Sequence[Measurement], lasting: float) -> tuple[FloatArray, FloatArray]:
    """What ``_elsewhere`` has of every log."""
    steps, missed = (np.concatenate(x) for x in zip(*(_elsewhere(m, lasting) for m in logs), strict=True))
    return steps, missed


def _elsewhere(m: Measurement, lasting: float) -> tuple[FloatArray, FloatArray]:
    """By how much an input changed over intervals of this length (n,), and what their ends miss of its integral."""
    t, value = m.t[m.good], m.value[m.good]
    if len(t) < 2 or not t[-1] - t[0] > lasting:
        return np.zeros(0), np.zeros(0)
    middle = value[:-1] if m.held else 0.5 * (value[1:] + value[:-1])
    integral = np.r_[0.0, np.cumsum(middle * np.diff(t))]
    a = np.linspace(t[0], t[-1] - lasting, PLACES)
    before, after = (_at(m.held, x, t, value) for x in (a, a + lasting))
    went = np.interp(a + lasting, t, integral) - np.interp(a, t, integral)
    between = before if m.held else 0.5 * (before + after)
    return after - before, np.abs(went - lasting * between)


def _at(held: bool, x: FloatArray, t: FloatArray, value: FloatArray) -> FloatArray:
    """Values at some times: those that hold, or straight lines between them."""
    found = value[np.searchsorted(t, x, side="right") - 1] if held else np.interp(x, t, value)
    return np.asarray(found, dtype=float)


def _without(segments: Segments, silences: Sequence[tuple[float, float]]) -> Segments:
    """Segments without what lies within silences, which are in order and apart."""
    begins, ends = zip(*silences, strict=True)
    heard = zip((-np.inf, *ends), (*begins, np.inf), strict=True)
    return tuple(intersect(list(segments), list(heard)))
