"""``seatrial init``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    folder: Annotated[
        Path, typer.Argument(help="Folder with the logs of one vessel.", metavar="DIR")
    ] = Path(),
) -> None:
    """Write a campaign.toml for the logs in DIR: what could be detected is filled in, the rest is marked.

    Example:

        seatrial init trials/2026-05-12
    """
    from shlex import quote

    from ingest.errors import UsageError
    from seatrial.campaign.load import FILENAME
    from seatrial.cli.stage_lines import StageLines
    from seatrial.initial import initial_campaign
    from seatrial.writable import check_folder

    check_folder(folder, "DIR")
    file = folder / FILENAME
    if file.exists():
        raise UsageError(f"{file} is there already; `seatrial init` does not overwrite it.")
    with StageLines(lines=False) as progress:
        progress("ingest", folder.name)
        start = initial_campaign(folder)
    with file.open("x", encoding="utf-8") as stream:
        stream.write(start.text)
    skipped = f"; no logs: {', '.join(start.skipped)}" if start.skipped else ""
    typer.echo(f"Wrote {file} for {len(start.logs)} log{'s' * (len(start.logs) != 1)}{skipped}.")
    typer.echo(
        f"Fill in the {start.open_marks} values marked REQUIRED, then: seatrial run {quote(str(folder))}"
    )
