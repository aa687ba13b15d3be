"""Where results go: written beside, then moved into place, so that a folder is whole or not there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from ingest.errors import UsageError
from seatrial.writable import check_folder

#: Everything that a results folder holds.
CONTENTS = frozenset({"report.json", "report.html", "model.json", "recording.rrd", "predictions", "trial"})


def check_replaceable(folder: Path) -> None:
    """Refuse a folder that holds anything but results, or that cannot be written.

    Raises
    ------
    UsageError
    """
    check_folder(folder.absolute().parent, "--out")
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"--out: expected a folder, found the file {folder}.")
    there = folder.iterdir() if folder.exists() else ()
    foreign = sorted(p.name for p in there if p.name not in CONTENTS)
    if foreign:
        lost = f"{folder} holds '{foreign[0]}', which is no result and would be lost"
        raise UsageError(f"--out: {lost}. Give another folder.")


@contextmanager
def in_place(folder: Path) -> Iterator[Path]:
    """A new folder to write to; at the end it takes the place of ``folder``, on an error it vanishes.

    Yields
    ------
    Path
        On the same file system as ``folder``.
    """
    check_replaceable(folder)
    folder = folder.absolute()
    folder.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent) as temporary:
        unfinished = Path(temporary) / folder.name
        unfinished.mkdir()
        yield unfinished
        if folder.exists():
            folder.rename(Path(temporary) / "previous")
        unfinished.rename(folder)
