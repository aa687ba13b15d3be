"""``seatrial recover``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    file: Annotated[Path, typer.Argument(help="An MCAP file that was never finished, or is damaged.")],
    out: Annotated[Path | None, typer.Option(help="The mended file; default: NAME-recovered.mcap.")] = None,
) -> None:
    """Mend a capture that was cut off: everything that can be read, in a whole file beside it.

    The file itself is left as it is. `seatrial run` and `seatrial inspect` read it without being mended, too;
    other programs may not.

    Example:

        seatrial recover trial.mcap
    """
    from seatrial.capture.recovery import recover
    from seatrial.cli.stage_lines import StageLines

    with StageLines(lines=False) as progress:
        progress("recover", file.name)
        done = recover(file, out)
    if not done.findings:
        typer.echo(f"{file}: whole, {done.messages:,} messages; there is nothing to mend")
        return
    for found in done.findings[:8]:
        typer.echo(f"  {found.message}")
    typer.echo(f"{done.path}: {done.messages:,} messages")
