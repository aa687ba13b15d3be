"""Whether what is asked for can be written: looked at before the work, which would be lost otherwise."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile

from ingest.errors import UsageError


def check_folder(folder: Path, option: str) -> None:
    """Refuse a folder in which no file can be made; one that is not there will be made, with its parents.

    Raises
    ------
    UsageError
        Names ``option``, by which the folder was given.
    """
    with _said(folder, option):
        there = next(p for p in (folder.absolute(), *folder.absolute().parents) if p.exists())
        if not there.is_dir():
            raise UsageError(f"{option}: expected a folder, found the file {there}.")
        TemporaryFile(dir=there).close()


def check_file(path: Path, option: str) -> None:
    """Refuse a file that cannot be made, or be written anew; its folder must be there.

    Raises
    ------
    UsageError
        Names ``option``, by which the file was given.
    """
    with _said(path, option):
        folder = path.absolute().parent
        if path.is_dir():
            raise UsageError(f"{option}: expected a file, found the folder {path}.")
        if not folder.is_dir():
            raise UsageError(f"{option}: the folder {folder} is not there; make it first.")
        if path.exists():
            path.open("ab").close()
        else:
            check_folder(folder, option)


@contextmanager
def _said(path: Path, option: str) -> Iterator[None]:
    """What the system says against it as one sentence."""
    try:
        yield
    except OSError as error:
        reason = (error.strerror or type(error).__name__).lower()
        raise UsageError(f"{option}: {path} cannot be written to ({reason}). Give another place.") from error
