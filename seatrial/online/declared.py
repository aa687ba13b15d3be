"""The campaign of a vessel under way: as in its ``campaign.toml``, whose logs need not be there yet."""

from __future__ import annotations

from pathlib import Path

from ingest.errors import CampaignError, UsageError
from seatrial.campaign.build import campaign_of
from seatrial.campaign.data import Campaign
from seatrial.campaign.load import campaign_file, checked, parsed
from seatrial.campaign.options import with_options
from seatrial.writable import check_file, check_folder

#: Estimators of the campaign that the on-line estimate stands for.
OUTPUT_ERROR = ("auto", "output_error")


def declared_campaign(path: Path, model: str | None = None) -> Campaign:
    """What a campaign says of vessel, inputs, sensors and model; its logs are not looked at.

    Raises
    ------
    UsageError
        The file is not there, or what it wants cannot be had on line; `CampaignError` where a key is wrong.
    """
    file = campaign_file(path)
    tables = parsed(file)
    if not tables.get("log"):
        tables["log"] = [{"path": "live"}]
    campaign = with_options(campaign_of(file, checked(file, tables)), model)
    if campaign.estimator not in OUTPUT_ERROR:
        expected = "output_error or auto: on line nothing else is estimated"
        raise CampaignError(file, "[model] estimator", expected, f"'{campaign.estimator}'")
    if campaign.model != "auto" and campaign.model.startswith("nomoto"):
        raise UsageError(f"{file}: the model '{campaign.model}' cannot be identified on line.")
    return campaign


def check_online(campaign: Path, state: Path | None, model: Path | None = None) -> None:
    """Check what an identification needs before anything is begun.

    Raises
    ------
    UsageError
        The campaign is wrong, or the state or the model cannot be kept where it is to be.
    """
    declared_campaign(campaign)
    for path, option in ((state, "--state"), (model, "--model")):
        if path is not None:
            check_file(path, option)
            check_folder(path.absolute().parent, option)
