"""``seatrial schema``."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import Annotated, Any

import typer


class Which(StrEnum):
    """What there is a schema of."""

    report = "report"
    model = "model"
    campaign = "campaign"


def named(text: str) -> Which:
    """What a word asks for."""
    if text not in list(Which):
        raise typer.BadParameter(f"expected {', '.join(Which)}, found '{text}'.")
    return Which(text)


def command(
    which: Annotated[Which, typer.Argument(help="Which file.", parser=named, metavar="|".join(Which))],
) -> None:
    """Print the JSON schema of report.json, model.json or campaign.toml.

    Example:

        seatrial schema campaign > campaign.schema.json
    """
    typer.echo(json.dumps(schema_of(which), indent=2, ensure_ascii=False))


def schema_of(which: Which) -> dict[str, Any]:
    """The schema."""
    if which is Which.campaign:
        from seatrial.campaign.schema import campaign_schema

        return campaign_schema()
    from validate.report.model_file import model_schema
    from validate.report.schema import report_schema

    return report_schema() if which is Which.report else model_schema()
