"""What a person should know of the logs of a campaign together, as sentences; whether any is left to validate on."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ingest.errors import NothingToValidate
from preprocess.run_of_log import LoggedRun
from preprocess.trial import Trial

#: Logs that are in one another's time by less than this follow each other, s.
FOLLOWING = 1.0


def remarks_on(runs: Sequence[LoggedRun], trials: Sequence[Trial]) -> tuple[str, ...]:
    """How the logs were divided, what is left of them to validate on, and which are not independent of each other."""
    starts = {t.name: t.start for t in trials}
    together = *same_records(runs), *overlaps(runs, starts)
    return (*divided(runs), *not_validated(trials), *beyond_the_end(runs), *together)


def divided(runs: Sequence[LoggedRun]) -> Iterator[str]:
    """That no log validates as a whole."""
    if all(run.role is None for run in runs):
        yield 'No log has role = "validate": the last third of each was held back to validate on.'


def beyond_the_end(runs: Sequence[LoggedRun]) -> Iterator[str]:
    """Slices that end after their logs: one may be mistyped."""
    sliced = [(r.name, r.slice, r.log.duration_s) for r in runs if r.slice is not None]
    found = [(name, cut, end) for name, cut, end in sliced if cut[1] > end + FOLLOWING]
    for name, (low, high), end in found[:1]:
        more = f" ({len(found)} such slices in all)" if found[1:] else ""
        asked = f"The slice [{low:g}, {high:g}] of {name} ends after the log, which lasts {end:.1f} s{more}"
        yield f"{asked}: {end - low:.1f} s of it are used."


def is_left(trials: Sequence[Trial], role: str) -> bool:
    """Whether any log, or part of one, with this role can be used."""
    return any(t.role == role and t.segments for t in trials)


def not_validated(trials: Sequence[Trial]) -> Iterator[str]:
    """That nothing was left to validate on."""
    if not is_left(trials, "validate"):
        yield "Nothing was validated: nothing with role validate has an unbroken stretch of five seconds."


def require_unseen(path: Path, runs: Sequence[LoggedRun], trials: Sequence[Trial]) -> None:
    """Something to validate on must be left wherever there is something to identify on.

    Raises
    ------
    NothingToValidate
    """
    if is_left(trials, "identify") and not is_left(trials, "validate"):
        raise NothingToValidate(path, divided=all(run.role is None for run in runs))


def same_records(runs: Sequence[LoggedRun]) -> Iterator[str]:
    """Logs that are copies of each other."""
    for *others, last in copies(runs):
        names = f"{', '.join(r.name for r in others)} and {last.name}"
        no_test = f"predicting one is no test of {'another' if others[1:] else 'the other'}"
        tested = {r.role for r in (*others, last)} == {"identify", "validate"}
        yield f"{names} hold the same records: {no_test if tested else 'what they say counts more than once'}."


def copies(runs: Sequence[LoggedRun]) -> list[list[LoggedRun]]:
    """Logs that hold the same records, two or more together."""
    groups: list[list[LoggedRun]] = []
    for run in runs:
        alike = next((g for g in groups if is_copy(g[0], run)), None)
        groups.append([run]) if alike is None else alike.append(run)
    return [g for g in groups if len(g) > 1]


def is_copy(a: LoggedRun, b: LoggedRun) -> bool:
    """Whether two logs hold the same records, and what is used of them is not apart."""
    (low, high), (begin, end) = within(a, 0.0), within(b, 0.0)
    mine, other = a.log.tables, b.log.tables
    return (
        min(high, end) > max(low, begin)
        and mine.keys() == other.keys()
        and all(table.equals(other[topic]) for topic, table in mine.items())
    )


def overlaps(runs: Sequence[LoggedRun], starts: Mapping[str, float]) -> Iterator[str]:
    """Logs of one vessel that are in one another's time, where times were declared or are known; copies apart."""
    found = []
    for a, b in itertools.combinations(runs, 2):
        (low, high), (begin, end) = (within(r, starts.get(r.name, 0.0)) for r in (a, b))
        seconds = min(high, end) - max(low, begin)
        if seconds > FOLLOWING and are_timed(a, b) and not is_copy(a, b):
            found.append(f"{a.name} and {b.name} overlap by {seconds:.0f} s in campaign time")
    if found:
        more = f" ({len(found)} such pairs in all)" if len(found) > 1 else ""
        yield f"{found[0]}{more}: check `start` and their clocks, or leave one out."


def within(run: LoggedRun, start: float) -> tuple[float, float]:
    """From when to when a log is used, s, if it starts then."""
    low, high = run.slice or (0.0, run.log.duration_s)
    return start + low, start + min(high, run.log.duration_s)


def are_timed(a: LoggedRun, b: LoggedRun) -> bool:
    """Whether it is known when two logs were recorded: both know UTC, or a start is declared."""
    known = a.log.utc_ns is not None and b.log.utc_ns is not None
    return known or a.start is not None or b.start is not None
