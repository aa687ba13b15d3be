"""Inputs that are entered in their log when they change, and perhaps now and then besides.

Such a log says more than one that is written at fixed times: up to its change an input had the value before. Its
entries come sooner after the last one where the value is new than where it is the same; or all are new and seldom, at
uneven intervals or of a few values that never come twice in a row; or often, but with pauses that are most of a log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from preprocess.commands import SELDOM, holds
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
#: Where no value is entered again and that is seldom, intervals are uneven if one in ten is so many times as long as
#: another; then changes are entered within this time, s.
UNEVEN, AT_ONCE = 2.0, 0.1
#: Pauses that tell how an input is entered are so many times as long as the shortest interval, and most of a log.
LONG, MOST = 5.0, 0.5
#: An interval that is longer than so many of the shortest is a pause, at whose end the value changed.
PAUSE = 1.5


def with_changes_known(trials: Sequence[Trial]) -> list[Trial]:
    """The trials with inputs that are entered at their changes known until shortly before each.

    What is never entered twice, and seldom, or hardly ever changes is logged as the others are if any of them is so.
    """
    logs, ticks = _ticks(trials)
    known = {n: known_between(some, ticks[n]) for n, some in logs.items()}
    return [
        replace(t, inputs={**t.inputs, **{n: m[k] for n, m in known.items()}}) for k, t in enumerate(trials)
    ]


def sampled_evenly(trials: Sequence[Trial]) -> tuple[str, ...]:
    """The inputs that are entered in their logs whether they change or not."""
    return tuple(name for name, tick in _ticks(trials)[1].items() if tick is None)


def _ticks(trials: Sequence[Trial]) -> tuple[dict[str, list[Measurement]], dict[str, float | None]]:
    """Every input in its logs, and within what time, s, its changes are entered; None where these are not awaited."""
    logs = {i.name: [t.inputs[i.name] for t in trials] for i in trials[0].inputs_declared}
    ticks = {name: _shortest(some) for name, some in logs.items()}
    if some_tick := min(filter(None, ticks.values()), default=None):
        unsure = [n for n, some in logs.items() if ticks[n] is None and (_never_twice(some) or _few(some))]
        ticks |= {n: min(some_tick, *(m.sample_time or some_tick for m in logs[n])) for n in unsure}
    return logs, ticks


def known_between(logs: Sequence[Measurement], tick: float | None) -> list[Measurement]:
    """One input in several logs, with its value until a ``tick``, s, before each change; None: as it is."""
    return list(logs) if tick is None else _held_together([_until_change(m, tick) for m in logs])


def changes(logs: Sequence[Measurement]) -> bool:
    """Whether an input has more than one value in its logs."""
    values = np.concatenate([m.value[m.good] for m in logs])
    return bool(len(values) and np.ptp(values) > 0.0)


def _shortest(logs: Sequence[Measurement]) -> float | None:
    """Shortest interval, s, between two changes of an input that is entered at these; None where it is not."""
    apart, new = _entries(logs)
    fresh, again = apart[new], apart[~new]
    if _never_twice(logs):
        ordered = len(fresh) >= LEAST and (_uneven(fresh) or _on_purpose(logs))
        return AT_ONCE if ordered else None
    if new.all() and _paused(logs):
        return _soonest(apart)
    if min(len(fresh), len(again)) < LEAST or not np.median(fresh) < SOONER * np.median(again):
        return None
    chance = stats.mannwhitneyu(fresh, again, alternative="less").pvalue
    return _soonest(fresh) if chance < BY_CHANCE else None


def _soonest(apart: FloatArray) -> float:
    return max(float(np.quantile(apart, SOONEST)), 1e-3)


def _paused(logs: Sequence[Measurement]) -> bool:
    """Whether an input is entered now and then after pauses that are most of a log, as no logger samples."""
    least = LONG * _soonest(_entries(logs)[0])
    each = [np.diff(m.t[m.good]) for m in logs]
    often = sum(int(np.sum(x > least)) for x in each) >= LEAST
    return often and any(x[x > least].sum() > MOST * x.sum() for x in each if len(x))


def _never_twice(logs: Sequence[Measurement]) -> bool:
    """Whether an input is entered seldom, and never with the value that it had."""
    apart, new = _entries(logs)
    return bool(new.all() and (not len(apart) or np.median(apart) > SELDOM))


def _few(logs: Sequence[Measurement]) -> bool:
    """Whether there are too few changes to tell anything by."""
    return int(_entries(logs)[1].sum()) < LEAST


def _uneven(apart: FloatArray) -> bool:
    """Whether intervals are so uneven that no logger samples like that."""
    short, long = np.quantile(apart, (0.1, 0.9))
    return bool(long > UNEVEN * short)


def _on_purpose(logs: Sequence[Measurement]) -> bool:
    """Whether values that come again and again would by chance have come twice in a row."""
    values = np.concatenate([m.value[m.good] for m in logs])
    share = np.unique(values, return_counts=True)[1] / len(values)
    return bool((1.0 - np.sum(share**2)) ** (len(values) - len(logs)) < BY_CHANCE)


def _entries(logs: Sequence[Measurement]) -> tuple[FloatArray, BoolArray]:
    """How long after the last entry of its log each one came, s, and whether its value is new."""
    apart = np.concatenate([np.diff(m.t[m.good]) for m in logs])
    return apart, np.concatenate([np.diff(m.value[m.good]) != 0.0 for m in logs])


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
