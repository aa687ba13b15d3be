"""Inputs that are entered in their log when they change, and now and then besides.

Such a log says more than one that is written at fixed times: up to its change an input had the value before. Its
entries come sooner after the last one where the value is new than where it is the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from preprocess.commands import holds
from preprocess.trial import Measurement, Trial

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Entries of either kind that must be there to tell.
LEAST = 5
#: New values come within this share of the interval at which old ones are entered again, and by chance in fewer than
#: this share of logs.
SOONER, BY_CHANCE = 0.8, 1e-3
#: New values come no sooner after one another than this quantile of what is before them.
SOONEST = 0.05
#: An interval that is longer than so many of the shortest is a pause, at whose end the value changed.
PAUSE = 1.5


def with_changes_known(trials: Sequence[Trial]) -> list[Trial]:
    """The trials with inputs that are entered at their changes known until shortly before each."""
    names = [i.name for i in trials[0].inputs_declared]
    known = {n: known_between([t.inputs[n] for t in trials]) for n in names}
    return [replace(t, inputs={**t.inputs, **{n: known[n][k] for n in names}}) for k, t in enumerate(trials)]


def known_between(logs: Sequence[Measurement]) -> list[Measurement]:
    """One input in several logs; where it is entered at its changes, with its value until shortly before each."""
    tick = _shortest(logs)
    return list(logs) if tick is None else _held_together([_until_change(m, tick) for m in logs])


def changes(logs: Sequence[Measurement]) -> bool:
    """Whether an input has more than one value in its logs."""
    values = np.concatenate([m.value[m.good] for m in logs])
    return bool(len(values) and np.ptp(values) > 0.0)


def _shortest(logs: Sequence[Measurement]) -> float | None:
    """Shortest interval, s, between two changes of an input that is entered at these; None where it is not."""
    apart, new = (np.concatenate(x) for x in zip(*map(_entries, logs), strict=True))
    fresh, again = apart[new], apart[~new]
    if min(len(fresh), len(again)) < LEAST or not np.median(fresh) < SOONER * np.median(again):
        return None
    chance = stats.mannwhitneyu(fresh, again, alternative="less").pvalue
    return max(float(np.quantile(fresh, SOONEST)), 1e-3) if chance < BY_CHANCE else None


def _entries(m: Measurement) -> tuple[FloatArray, BoolArray]:
    """How long after the last entry each one came, s, and whether its value is new."""
    return np.diff(m.t[m.good]), np.diff(m.value[m.good]) != 0.0


def _until_change(m: Measurement, tick: float) -> Measurement:
    """The same with what an input was a ``tick``, s, before it changed, where nothing was entered then."""
    t, value = m.t[m.good], m.value[m.good]
    at = 1 + np.flatnonzero((np.diff(value) != 0.0) & (np.diff(t) > PAUSE * tick))
    t, value = np.insert(t, at, t[at] - tick), np.insert(value, at, value[at - 1])
    return replace(m, t=t, value=value, good=np.ones(len(t), dtype=bool), sample_time=tick)


def _held_together(logs: Sequence[Measurement]) -> list[Measurement]:
    """The logs of one input read alike: as steps that hold where any of them looks like that at even times."""
    held = any(changes([m]) and holds(_at_even_times(m)) for m in logs)
    return [replace(m, held=held) for m in logs]


def _at_even_times(m: Measurement) -> FloatArray:
    """Values at every ``sample_time``, held."""
    t = np.arange(m.t[0], m.t[-1], m.sample_time)
    return np.asarray(m.value[np.searchsorted(m.t, t + 1e-9, side="right") - 1], dtype=float)
