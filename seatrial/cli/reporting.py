"""How errors reach a user: one clear sentence and an exit status, a traceback only on demand."""

from __future__ import annotations

import functools
import io
import sys
import traceback
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import typer

if TYPE_CHECKING:
    from ingest.errors import SeatrialError

P = ParamSpec("P")
R = TypeVar("R")

INTERRUPTED = 130


class Interrupted(Exception):
    """Ctrl-C as an exception: the library of the command line would end at a ``KeyboardInterrupt`` without a word."""


def interruptible(command: Callable[P, R]) -> Callable[P, R]:
    """The same command; Ctrl-C ends it as `Interrupted`."""

    @functools.wraps(command)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return command(*args, **kwargs)
        except KeyboardInterrupt as error:
            raise Interrupted from error

    return call


def prepare_streams() -> None:
    """Never fail on a character that the terminal cannot show."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def complain(message: str, kind: str = "Error") -> None:
    """Write a sentence to stderr, its first word in red on a terminal."""
    typer.echo(f"{typer.style(kind + ':', fg='red', bold=True)} {message}", err=True)


class Reporting:
    """A ``with`` block that turns every exception into a message and an exit status."""

    def __init__(self, debug: bool = False) -> None:
        self.debug = debug

    def __enter__(self) -> Reporting:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None or isinstance(error, SystemExit):
            return
        if self.debug:
            traceback.print_exception(error)
            if details := getattr(error, "details", ""):
                typer.echo(details, err=True)
        raise SystemExit(report(error))


def report(error: BaseException) -> int:
    """Say what went wrong; the exit status."""
    if isinstance(error, (KeyboardInterrupt, Interrupted)):
        complain("nothing half-written is left.", "Interrupted")
        return INTERRUPTED
    expected = as_expected(error)
    if expected is not None:
        complain(str(expected))
        for note in getattr(expected, "__notes__", ()):
            complain(note, "Also")
        return expected.exit_status
    place = traceback.extract_tb(error.__traceback__)[-1:]
    where = f" in {place[0].filename}, line {place[0].lineno}" if place else ""
    what = " ".join(str(error).split()) or "no message"
    complain(f"unexpected {type(error).__name__}{where}: {what} (--debug shows the traceback)")
    return 1


def as_expected(error: BaseException) -> SeatrialError | None:
    """The error, if it is one of Seatrial's own; only loaded modules can have raised one."""
    if "ingest.errors" not in sys.modules:
        return None
    from ingest.errors import SeatrialError

    return error if isinstance(error, SeatrialError) else None
