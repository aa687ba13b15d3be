"""The program and its commands.

A command is a module ``seatrial.cli.NAME_command`` with a function ``command``; one that is not there is not
offered. Such a module imports nothing heavy before it is called.
"""

from __future__ import annotations

import importlib
import importlib.util
from importlib import metadata
from typing import Annotated

import typer

from seatrial.cli.reporting import interruptible

COMMANDS = (
    "demo", "inspect", "init", "run", "compare", "capture", "replay", "recover", "simulate", "view", "fleet",
    "schema",
)  # fmt: skip

HELP = """From the logs of a sea trial to a manoeuvring model, how far to trust it, and what it lacks.

Start with `seatrial demo`. With logs of your own: `seatrial inspect LOG`, `seatrial init DIR`, fill in what
campaign.toml leaves open, then `seatrial run DIR`.
"""


def make_app() -> typer.Typer:
    """The program with every command whose module is there."""
    app = typer.Typer(
        name="seatrial",
        help=HELP,
        no_args_is_help=True,
        rich_markup_mode="markdown",
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(options)
    for name in COMMANDS:
        module = f"seatrial.cli.{name}_command"
        if importlib.util.find_spec(module) is not None:
            app.command(name)(interruptible(importlib.import_module(module).command))
    return app


def show_version(wanted: bool) -> None:
    """Print the version and end."""
    if wanted:
        typer.echo(f"seatrial {metadata.version('seatrial')}")
        raise typer.Exit


def options(
    version: Annotated[
        bool, typer.Option("--version", callback=show_version, is_eager=True, help="Print the version.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of an error; may stand anywhere.")
    ] = False,
) -> None:
    """Options of every command."""
