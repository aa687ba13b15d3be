"""What the command line changes in a campaign: it wins over the file."""

from __future__ import annotations

from dataclasses import replace

from ingest.errors import CampaignError, UsageError, nearest
from seatrial.campaign.data import Campaign
from seatrial.campaign.input_rules import without_position
from seatrial.campaign.load import checked, parsed
from seatrial.names import ESTIMATORS, MODELS, OPTIMISERS

CHOICES = {"model": MODELS, "estimator": ESTIMATORS, "optimiser": OPTIMISERS}


def with_options(
    campaign: Campaign, model: str | None = None, estimator: str | None = None, optimiser: str | None = None
) -> Campaign:
    """The campaign with what was given in place of what the file says.

    Raises
    ------
    UsageError
        A name is not known.
    CampaignError
        The model needs positions that the campaign does not have.
    """
    if model is not None:
        check_positions(campaign, check_name("model", model))
    return replace(
        campaign,
        model=model or campaign.model,
        estimator=check_name("estimator", estimator or campaign.estimator),
        optimiser=check_name("optimiser", optimiser or campaign.optimiser),
    )


def check_name(option: str, name: str) -> str:
    """The name itself, if it is known."""
    if name in CHOICES[option]:
        return name
    near = nearest(name, CHOICES[option])
    hint = f" Did you mean '{near[0]}'?" if near else ""
    raise UsageError(f"{option}: expected one of {', '.join(CHOICES[option])}, found '{name}'.{hint}")


def check_number(option: str, number: int, least: int) -> None:
    """Complain of what is no whole number, or less than the least.

    Raises
    ------
    UsageError
    """
    if not (hasattr(number, "__index__") and number >= least):
        raise UsageError(f"{option}: expected a whole number from {least} up, found {number}.")


def check_positions(campaign: Campaign, model: str) -> None:
    """Every input must have a position where the model needs it."""
    inputs = checked(campaign.path, parsed(campaign.path)).inputs
    for name in without_position(model, inputs):
        expected = f"a position, which the model '{model}' needs ([m forward, m starboard])"
        raise CampaignError(campaign.path, f"[inputs.{name}] position", expected, "none")
