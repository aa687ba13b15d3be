"""What a campaign says of its logs, against the logs as they were read."""

from __future__ import annotations

from collections.abc import Sequence

from ingest.log import Log
from seatrial.campaign.data import Campaign
from seatrial.campaign.faults import Fault, campaign_error, found


def check_slices(campaign: Campaign, logs: Sequence[Log]) -> None:
    """Every slice must have something of its log.

    Raises
    ------
    CampaignError
        For the first that has nothing; the others are its notes.
    """
    faults = [
        Fault(("log", number, "slice"), within(log), found(list(entry.slice)))
        for number, (entry, log) in enumerate(zip(campaign.logs, logs, strict=True))
        if entry.slice is not None and entry.slice[0] >= log.duration_s
    ]
    if faults:
        raise campaign_error(campaign.path, faults, [entry.path for entry in campaign.logs])


def within(log: Log) -> str:
    """What a slice of a log may be."""
    return f"[from, to] within the log, which goes from 0 to {log.duration_s:.1f} s"
