"""``campaign.toml``: read, checked, and turned into data."""

from seatrial.campaign.against_logs import check_against
from seatrial.campaign.data import Campaign, LogEntry
from seatrial.campaign.load import load_campaign
from seatrial.campaign.options import check_number, with_options
from seatrial.campaign.schema import campaign_schema

__all__ = [
    "Campaign", "LogEntry", "campaign_schema", "check_against", "check_number", "load_campaign", "with_options",
]  # fmt: skip
