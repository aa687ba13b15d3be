"""``seatrial demo``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

STORY = """\
A small campaign of a simulated vessel, its logs in the formats of the field. Something acts on it that the
declared model does not know. Seatrial reads the logs, fits the model, and looks for what is missing.
"""


def command(
    out: Annotated[Path, typer.Option(help="Folder for the campaign and its results.")] = Path(
        "seatrial-demo"
    ),
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same results.")] = 0,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Run the small campaign that comes with the program, and say what it finds.

    Example:

        seatrial demo --out ~/seatrial-demo
    """
    from seatrial.campaign import load_campaign
    from seatrial.cli.stage_lines import StageLines
    from seatrial.cli.summary import print_summary
    from seatrial.demonstration import copy_demo, is_changed

    campaign = load_campaign(copy_demo(out))
    if not quiet:
        typer.echo(STORY, err=True)
        if is_changed(campaign.path):
            typer.echo(f"{campaign.path} was changed, and is run as it stands.", err=True)
    from seatrial.pipeline import run

    with StageLines(quiet=quiet) as progress:
        results = run(campaign, out / "results", seed=seed, progress=progress)
    if not quiet:
        print_summary(results, out / "results")
        typer.echo(f"Your own logs: seatrial inspect LOG, seatrial init DIR. This campaign: {campaign.path}")
