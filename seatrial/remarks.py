"""What a person should know of the logs of a campaign together, as sentences; whether any is left to validate on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from ingest.errors import NothingToValidate
from preprocess.run_of_log import LoggedRun
from preprocess.trial import Trial


def remarks_on(runs: Sequence[LoggedRun], trials: Sequence[Trial]) -> tuple[str, ...]:
    """Whether any log is left to validate on."""
    return (*not_validated(trials),)


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
