"""``seatrial inspect``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from seatrial.inspection import LogFacts
    from seatrial.reader_choice import ReaderChoice


def command(
    logs: Annotated[list[Path], typer.Argument(help="Logs of any known format.", metavar="LOG...")],
    format: Annotated[str | None, typer.Option(help="Format, where detection must be overruled.")] = None,
    dialect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="Delimited text: columns, skip, delimiter, decimal, encoding; MAVLink: mavlink=common. Repeatable.",
        ),
    ] = None,
    topic: Annotated[list[str] | None, typer.Option(help="Read this topic only. Repeatable.")] = None,
    dbc: Annotated[Path | None, typer.Option(help="DBC file for CAN logs.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the facts as JSON.")] = False,
) -> None:
    """Say what is in a log, and which signals look like position, heading, yaw rate and inputs.

    A log that a campaign.toml in its folder names is read as that says, but for what is given here.

    Examples
    --------
        seatrial inspect 00000216.bin

        seatrial inspect *.nmea --json

        seatrial inspect run.dat --dialect "columns=t x y psi_deg" --dialect skip=4
    """
    from seatrial.cli.stage_lines import StageLines
    from seatrial.inspection import inspect_log
    from seatrial.reader_choice import ReaderChoice, checked_dbc, chosen_for, dialect_of

    known_dbc = None if dbc is None else checked_dbc(dbc)
    asked = ReaderChoice(format, dialect_of(dialect or ()), tuple(topic) if topic else None, known_dbc)
    facts = []
    for path in logs:
        choice = chosen_for(path, asked)
        with StageLines(quiet=json, lines=False) as progress:
            progress("ingest", path.name)
            facts.append(inspect_log(choice.read(path)))
        if not json:
            print_facts(facts[-1], choice)
    if json:
        typer.echo(as_json(facts))


def as_json(facts: list[LogFacts]) -> str:
    """All facts; one object for one log, else a list."""
    import json
    from dataclasses import asdict

    plain = [asdict(f) for f in facts]
    return json.dumps(plain[0] if len(plain) == 1 else plain, indent=2, ensure_ascii=False)


def print_facts(facts: LogFacts, choice: ReaderChoice) -> None:
    """Facts of one log, read as chosen, as tables that fit 80 columns."""
    from seatrial.cli.tables import inspection_tables, say

    told = (f"Read as {choice.told_by} says.",) if choice.told_by else ()
    say(*inspection_tables(facts, choice.declared), *told)
