"""``seatrial compare``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from seatrial.cli.run_command import CampaignPath, cores

if TYPE_CHECKING:
    import pandas as pd


def command(
    campaign: CampaignPath,
    model: Annotated[
        str | None, typer.Option(help="Models, comma-separated [default: all whose inputs exist].")
    ] = None,
    estimator: Annotated[
        str | None, typer.Option(help="Estimators, likewise [default: output_error,weak_form,ls,rw_lssvr].")
    ] = None,
    optimiser: Annotated[str | None, typer.Option(help="Optimisers, likewise [default: auto].")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Plot (.png, .svg or .pdf); the table goes beside it as .csv.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same results.")] = 0,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes [default: one per core].")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Dask scheduler, tcp://…")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the table as JSON.")] = False,
) -> None:
    """Put the same data through several models, estimators and optimisers; best first by unseen logs.

    Examples
    --------
        seatrial compare trials

        seatrial compare trials --model blanke,modulus --estimator output_error --optimiser auto,aco_r --out table.svg
    """
    from seatrial.campaign import load_campaign
    from seatrial.campaign.options import check_name
    from seatrial.cli.stage_lines import StageLines
    from seatrial.manoeuvre_plot import checked_picture

    if out is not None:
        checked_picture(out)
    chosen = {
        option: [check_name(option, n) for n in _names(text)]
        for option, text in (("model", model), ("estimator", estimator), ("optimiser", optimiser))
    }
    loaded = load_campaign(campaign)
    from seatrial.comparison import ESTIMATORS, OPTIMISERS, compare

    with StageLines(quiet=quiet or json) as progress:
        table = compare(
            loaded,
            chosen["model"],
            chosen["estimator"] or ESTIMATORS,
            chosen["optimiser"] or OPTIMISERS,
            seed=seed,
            workers=workers or cores(),
            scheduler=scheduler,
            progress=progress,
        )
    if out is not None:
        from seatrial.comparison_plot import plot_comparison

        plot_comparison(table, out)
        table.to_csv(out.with_suffix(".csv"), index=False)
    if json:
        typer.echo(table.to_json(orient="records", indent=1, force_ascii=False))
    else:
        _show(table)


def _names(text: str | None) -> list[str]:
    return [n.strip() for n in (text or "").split(",") if n.strip()]


def _show(table: pd.DataFrame) -> None:
    from rich.text import Text

    from seatrial.cli.tables import say, table_of

    columns = ("Model", "Estimator", "Optimiser", "Error", "R² u", "R² v", "R² r", "s")
    values = ["error", "r2_u", "r2_v", "r2_r", "seconds"]
    numbers = table[values].astype(float).to_numpy()
    names = table[["model", "estimator", "optimiser"]].astype(str).to_numpy()
    rows = [[*map(str, n), *map(_short, v)] for n, v in zip(names, numbers, strict=True)]
    notes = [f"{n[0]}: {note}" for n, note in zip(names, table["note"].fillna(""), strict=True) if note]
    say(table_of(columns, rows, columns[3:]), *(Text(note, style="yellow") for note in dict.fromkeys(notes)))


def _short(value: float) -> str:
    if value != value:
        return "–"
    return f"{value:.3f}" if abs(value) < 10 else f"{value:.2g}"
