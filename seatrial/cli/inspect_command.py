"""``seatrial inspect``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from seatrial.inspection import LogFacts


def command(
    logs: Annotated[list[Path], typer.Argument(help="Logs of any known format.", metavar="LOG...")],
    format: Annotated[str | None, typer.Option(help="Format, where detection must be overruled.")] = None,
    dbc: Annotated[Path | None, typer.Option(help="DBC file for CAN logs.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the facts as JSON.")] = False,
) -> None:
    """Say what is in a log, and which signals look like position, heading, yaw rate and inputs.

    Examples
    --------
        seatrial inspect 00000216.bin

        seatrial inspect *.nmea --json
    """
    from ingest import read_log
    from seatrial.inspection import inspect_log

    facts = []
    for path in logs:
        facts.append(inspect_log(read_log(path, format=format, dbc=dbc)))
        if not json:
            print_facts(facts[-1])
    if json:
        typer.echo(as_json(facts))


def as_json(facts: list[LogFacts]) -> str:
    """All facts; one object for one log, else a list."""
    import json
    from dataclasses import asdict

    plain = [asdict(f) for f in facts]
    return json.dumps(plain[0] if len(plain) == 1 else plain, indent=2, ensure_ascii=False)


def print_facts(facts: LogFacts) -> None:
    """Facts of one log as tables that fit 80 columns."""
    from seatrial.cli.tables import inspection_tables, say

    say(*inspection_tables(facts))
