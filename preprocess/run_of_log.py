"""One log as a campaign declares it: what ``make_trials`` is given."""

from __future__ import annotations

from dataclasses import dataclass

from ingest.log import Log

#: No unbroken stretch of a log that is shorter can be used, s.
LEAST_SECONDS = 5.0


@dataclass(frozen=True)
class LoggedRun:
    """A log with what the campaign says of it.

    Attributes
    ----------
    name : str
        Path as the campaign writes it.
    log : Log
        As read.
    role : str, optional
        ``"identify"`` or ``"validate"``; None where no log of the campaign says: its last third validates.
    manoeuvre : str, optional
        As declared; None: found from the motion.
    start : float, optional
        Campaign time at the log's first record, s, where its own clock does not say.
    slice : (start, end), optional
        Seconds since the log's first record; what lies outside is not used.
    depth : float, optional
        Depth of water, m.
    """

    name: str
    log: Log
    role: str | None
    manoeuvre: str | None = None
    start: float | None = None
    slice: tuple[float, float] | None = None
    depth: float | None = None
