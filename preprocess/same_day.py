"""When logs began whose clocks tell the time of day and no date: on the campaign's one day.

A receiver's position sentences have the time of day alone. Where others of the campaign's logs know the date, theirs is
meant, or the day before or after where that is nearer (a night's work); where none does, logs began within half a day.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from preprocess.run_of_log import LoggedRun

#: Nanoseconds.
SECOND = 10**9
DAY = 86_400 * SECOND


def on_one_day(runs: Sequence[LoggedRun]) -> list[LoggedRun]:
    """The runs, those that know the time of day alone with the campaign time at which they began.

    What is declared stays as it is.
    """
    dated = [run.log.utc_ns for run in runs if run.log.utc_ns is not None]
    times = dated or [run.log.of_day_ns for run in runs if run.log.of_day_ns is not None][:1]
    return [_started(run, times) for run in runs]


def said_of_day(run: LoggedRun) -> list[str]:
    """What is said of a log that knows the time of day alone."""
    if run.log.of_day_ns is None or run.log.utc_ns is not None or run.start is None:
        return []
    return [f"No record has a date: it began at {run.start:.0f} s of campaign time."]


def _started(run: LoggedRun, times: Sequence[int]) -> LoggedRun:
    """A run with its start where its log knows the time of day alone; ``times``: campaign time 0, and others known."""
    of_day = run.log.of_day_ns
    if of_day is None or run.log.utc_ns is not None or run.start is not None:
        return run
    later = [(time, (of_day - time + DAY // 2) % DAY - DAY // 2) for time in times]
    time, since = min(later, key=lambda pair: abs(pair[1]))
    return replace(run, start=(time + since - times[0]) / SECOND)
