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
    from seatrial.writable import check_file

    if out is not None:
        check_file(checked_picture(out).with_suffix(".csv"), "--out")
    chosen = {
        option: [check_name(option, n) for n in _names(option, text)]
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


def _names(option: str, text: str | None) -> list[str]:
    names = [n.strip() for n in (text or "").split(",") if n.strip()]
    if text is not None and not names:
        from ingest.errors import UsageError

        raise UsageError(f"--{option}: expected names between commas, found none.")
    return names


#: Of what the figures are.
LEGEND = (
    "The column Error is of free runs on unseen logs, in standard deviations of u, v, r (1: no better than their "
    "mean); s is the processor time of the fit. No effect beyond the model's own terms is looked for here; "
    "'seatrial run' does that."
)
#: Where the best error is larger than this, all methods miss the same thing.
POOR = 0.7


def _show(table: pd.DataFrame) -> None:
    from rich.text import Text

    from seatrial.cli.tables import say, table_of

    tried = table[table["estimator"] != ""]
    plain = bool((tried["optimiser"] == "auto").all())
    names = ["model", "estimator"] + ([] if plain else ["optimiser"])
    columns = (*(n.capitalize() for n in names), "Error", "R² u", "R² v", "R² r", "s")
    values = tried[["error", "r2_u", "r2_v", "r2_r", "seconds"]].astype(float).to_numpy()
    rows = [
        [*map(str, n), _short(v[0]), *map(_share, v[1:4]), _short(v[4])]
        for n, v in zip(tried[names].to_numpy(), values, strict=True)
    ]
    say(table_of(columns, rows, columns[len(names) :]), Text(LEGEND, style="dim"))
    say(*(Text(line, style="yellow") for line in _remarks(table)))


def _remarks(table: pd.DataFrame) -> list[str]:
    """What is to be said of methods that failed, and of all of them."""
    by_note: dict[str, list[str]] = {}
    for row in table.itertuples():
        if row.note:
            by_note.setdefault(str(row.note), []).append(f"{row.model} {row.estimator}".strip())
    lines = [f"{', '.join(names)}: {note}" for note, names in by_note.items() if len(names) < len(table)]
    lines += [note for note, names in by_note.items() if len(names) == len(table)]
    if float(table["error"].min()) > POOR:
        lines.append("No method predicts these logs well: 'seatrial run' looks for what the models lack.")
    return lines


def _short(value: float) -> str:
    if value != value:
        return "–"
    if value >= 1e4:
        return f"{value:.0e}"
    return f"{value:.3f}" if value < 10 else f"{value:.0f}"


def _share(value: float) -> str:
    """An R²; how far below nothing it is says nothing."""
    if value != value:
        return "–"
    return f"{value:.3f}" if value > -9.9995 else "< -10"
