"""What a campaign says of its logs, against the logs as they were read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ingest.log import Log
from preprocess.run_of_log import LEAST_SECONDS
from seatrial.campaign.data import Campaign, LogEntry
from seatrial.campaign.faults import Fault, campaign_error, found

#: Keys of a dialect that a format reads; others read none.
READ: Mapping[str, tuple[str, ...]] = {
    "csv": ("columns", "skip", "delimiter", "decimal", "encoding"),
    "tlog": ("mavlink",),
}


def check_against(campaign: Campaign, logs: Sequence[Log]) -> None:
    """Every slice must have something of its log, and every dialect say something to it.

    Raises
    ------
    CampaignError
        For the first that does not; the others are its notes.
    """
    faults = [
        fault
        for number, (entry, log) in enumerate(zip(campaign.logs, logs, strict=True))
        for fault in (*slice_faults(number, entry, log), *dialect_faults(number, entry, log))
    ]
    if faults:
        raise campaign_error(campaign.path, faults, [entry.path for entry in campaign.logs])


def slice_faults(number: int, entry: LogEntry, log: Log) -> Iterator[Fault]:
    """A slice that has next to nothing of its log."""
    if entry.slice is not None and min(entry.slice[1], log.duration_s) - entry.slice[0] < LEAST_SECONDS:
        yield Fault(("log", number, "slice"), within(log), found(list(entry.slice)))


def within(log: Log) -> str:
    """What a slice of a log may be."""
    return f"[from, to] with {LEAST_SECONDS:g} s of the log, which goes from 0 to {log.duration_s:.1f} s"


def dialect_faults(number: int, entry: LogEntry, log: Log) -> Iterator[Fault]:
    """Keys of a dialect that the format of the log has no use for."""
    for key in entry.dialect:
        if key not in READ.get(log.format, ()):
            readers = " or ".join(f'format = "{name}"' for name, keys in READ.items() if key in keys)
            expected = f"no such key for a log of the format {log.format}: only with {readers}"
            yield Fault(("log", number, "dialect", key), expected, "it")
