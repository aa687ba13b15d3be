"""``seatrial run``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

CampaignPath = Annotated[Path, typer.Argument(help="campaign.toml, or the folder that holds it.")]


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def command(
    campaign: CampaignPath,
    out: Annotated[
        Path | None, typer.Option(help="Results folder [default: results beside CAMPAIGN].")
    ] = None,
    model: Annotated[str | None, typer.Option(help="Model, in place of the campaign's.")] = None,
    estimator: Annotated[str | None, typer.Option(help="Estimator, likewise.")] = None,
    optimiser: Annotated[str | None, typer.Option(help="Optimiser, likewise.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same results.")] = 0,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes [default: one per core].")] = None,
    no_loop: Annotated[
        bool, typer.Option("--no-loop", help="Do not search for what the model lacks.")
    ] = False,
    materiality: Annotated[
        float, typer.Option(min=0.0, help="Unexplained share of a channel that counts.")
    ] = 0.10,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Print all findings and parameters.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print report.json.")] = False,
) -> None:
    """Identify a model from a campaign's logs, validate it, and find out what it lacks.

    Examples
    --------
        seatrial run trials/2026-05-12

        seatrial run campaign.toml --model modulus --out modulus --json
    """
    from seatrial.campaign import load_campaign, with_options
    from seatrial.cli.stage_lines import StageLines
    from seatrial.cli.summary import print_summary
    from seatrial.results_folder import check_replaceable

    chosen = with_options(load_campaign(campaign), model, estimator, optimiser)
    folder = out or chosen.path.parent / "results"
    check_replaceable(folder)
    from seatrial.pipeline import run

    with StageLines(quiet=quiet or json) as progress:
        results = run(
            chosen,
            folder,
            seed=seed,
            workers=workers or cores(),
            loop=not no_loop,
            materiality=materiality,
            progress=progress,
        )
    if json:
        typer.echo((folder / "report.json").read_text(encoding="utf-8"))
    elif not quiet:
        print_summary(results, folder, verbose)
