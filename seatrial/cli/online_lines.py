"""``seatrial replay --campaign``: a recorded log identified as if it came in now."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from seatrial.online.online_process import Timed


def identify_recorded(
    file: Path, campaign: Path, state: Path | None, forget_minutes: float | None, model: Path | None
) -> None:
    """Feed a log to the identification as fast as it goes, and print what it says.

    Raises
    ------
    UsageError
        The campaign, the log or the state is wrong.
    DataError
        No model could be identified.
    """
    from ingest.errors import DataError, UsageError
    from seatrial.online.declared import check_online, declared_campaign
    from seatrial.online.online_process import OnlineWanted
    from seatrial.online.recorded import batches, recorded_log
    from seatrial.online.running import Running

    check_online(campaign, state, model)
    if not file.is_file():
        raise UsageError(f"{file}: there is no such file.")
    if forget_minutes is not None and not forget_minutes > 0:
        raise UsageError(f"--forget-minutes: expected a positive number, found {forget_minutes:g}.")
    forget_s = float("inf") if forget_minutes is None else 60.0 * forget_minutes
    running = Running(OnlineWanted(campaign, state, forget_s, model))
    log = recorded_log(file, declared_campaign(campaign).dbc)
    for tables in batches(log):
        tell(running.feed("log", tables))
    tell(running.finish())
    for line in running.lines():
        typer.echo(line)
    if running.identifier.estimator is None:
        raise DataError(f"{file}: nothing could be identified from it.")


def tell(updates: list[Timed]) -> None:
    """Print the notes among updates."""
    from seatrial.online.updates import Note

    for _, update in updates:
        if isinstance(update, Note):
            text = f"{update.t:8.1f} s  {update.text}"
            typer.echo(typer.style(text, fg="yellow") if update.warning else text)
