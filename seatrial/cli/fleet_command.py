"""``seatrial fleet``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from seatrial.cli.run_command import cores

if TYPE_CHECKING:
    import pandas as pd

    from seatrial.cli.stage_lines import StageLines


def command(
    campaigns: Annotated[
        list[Path], typer.Argument(metavar="CAMPAIGN...", help="Campaigns, or folders with campaigns below.")
    ],
    out: Annotated[Path, typer.Option(help="Summary (.csv or .parquet).")] = Path("fleet.csv"),
    results: Annotated[
        Path | None, typer.Option(help="Folder for all results [default: results beside each campaign].")
    ] = None,
    model: Annotated[str | None, typer.Option(help="Model, in place of the campaigns'.")] = None,
    estimator: Annotated[str | None, typer.Option(help="Estimator, likewise.")] = None,
    optimiser: Annotated[str | None, typer.Option(help="Optimiser, likewise.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same results.")] = 0,
    no_loop: Annotated[
        bool, typer.Option("--no-loop", help="Do not search for what the models lack.")
    ] = False,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes [default: one per core].")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Dask scheduler, tcp://…")] = None,
    again: Annotated[bool, typer.Option("--again", help="Run finished campaigns again.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Run many campaigns; those that are finished and unchanged are not run again.

    The exit status is 2 where a campaign file is wrong, else 1 where one gave no results.

    Examples
    --------
        seatrial fleet trials/*/ --out fleet.parquet

        seatrial fleet trials --scheduler tcp://head:8786
    """
    from seatrial.campaign.options import check_name
    from seatrial.cli.stage_lines import StageLines
    from seatrial.fleet_run import Options, campaigns_in, checked_summary, fleet, voyages
    from seatrial.writable import check_folder

    for option, name in (("model", model), ("estimator", estimator), ("optimiser", optimiser)):
        if name is not None:
            check_name(option, name)
    options = Options(model, estimator, optimiser, seed, not no_loop)
    if results is not None:
        check_folder(results, "--results")
    planned = voyages(campaigns_in(campaigns), options, results)
    with StageLines(quiet=quiet, lines=False) as progress:
        progress("fleet", "", 0.0)
        table = fleet(
            planned,
            checked_summary(out),
            workers=workers or cores(),
            scheduler=scheduler,
            again=again,
            tell=partial(_tell, progress),
        )
    if not quiet:
        _show(table, out)
    _complain_of(table, out)


def _complain_of(table: pd.DataFrame, out: Path) -> None:
    """An error where a campaign gave no results."""
    from ingest.errors import DataError, UsageError
    from seatrial.fleet_run import DONE, WRONG

    failed, wrong = int((table["status"] != DONE).sum()), int((table["status"] == WRONG).sum())
    said = f"{failed} of {len(table)} campaigns gave no results"
    if wrong:
        raise UsageError(f"{said}, {wrong} of them because their file is wrong; {out} says why.")
    if failed:
        raise DataError(f"{said}; {out} says why.")


def _tell(progress: StageLines, row: dict[str, Any], count: int, total: int) -> None:
    """A line per campaign that is done, above the bar."""
    name, what = Path(row["campaign"]).parent.name, row.get("verdict") or row["status"]
    progress.say(f"{count}/{total}  {name}: {what}")
    progress("fleet", f"{count} of {total}", count / total)


def _show(table: pd.DataFrame, out: Path) -> None:
    from rich.text import Text

    from seatrial.cli.tables import say, table_of

    names = [Path(c).parent.name for c in table["campaign"].astype(str)]
    found = table[["status", "verdict", "effects", "error"]].astype("string").fillna("").to_numpy()
    numbers = table[["fitness_before", "fitness_after", "seconds"]].astype(float).to_numpy()
    rows = [
        [name, str(verdict or status), str(effects), *(f"{x:.3g}" if x == x else "–" for x in n)]
        for name, (status, verdict, effects, _), n in zip(names, found, numbers, strict=True)
    ]
    columns = ("Campaign", "Verdict", "Effects", "Before", "After", "s")
    say(table_of(columns, rows, columns[3:]))
    say(
        *(Text(f"{name}: {why}", style="yellow") for name, (*_, why) in zip(names, found, strict=True) if why)
    )
    say(Text(f"Summary: {out}", no_wrap=True))
