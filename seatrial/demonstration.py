"""The small campaign that comes with the program."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ingest.errors import DataError, UsageError
from seatrial.campaign.load import FILENAME
from seatrial.writable import check_folder


def demo_source() -> Path:
    """Folder of the demo campaign: in the installed package, else in the checkout.

    Raises
    ------
    DataError
        The installation lacks it.
    """
    package = Path(__file__).resolve().parent
    for folder in (package / "demo", package.parent / "fixtures" / "demo"):
        if (folder / FILENAME).is_file():
            return folder
    raise DataError(f"the demo campaign is missing from this installation ({package / 'demo'}).")


def copy_demo(out: Path) -> Path:
    """Copy the demo campaign; no file that is there is written over.

    Parameters
    ----------
    out : Path
        A new folder, an empty one, or one that holds a copy from before; what was changed in the campaign of a copy
        stays.

    Returns
    -------
    Path
        Its campaign file.

    Raises
    ------
    UsageError
        ``out`` holds something else, or cannot be written to.
    """
    check_folder(out, "--out")
    files = demo_files()
    foreign = foreign_in(out, files)
    if foreign:
        raise UsageError(
            f"--out: {out} holds '{foreign[0]}', which is not the demo's own. Give a new folder."
        )
    out.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        if not (out / name).exists():
            (out / name).write_bytes(data)
    return out / FILENAME


def demo_files() -> dict[str, bytes]:
    """The demo's files by name."""
    source = demo_source()
    return {p.name: p.read_bytes() for p in source.iterdir() if p.is_file() and not p.name.startswith(".")}


def foreign_in(folder: Path, files: Mapping[str, bytes]) -> list[str]:
    """What is seen in a folder and not the demo's own; beside all its logs, the campaign may have been changed."""
    there = {p.name: p for p in folder.iterdir() if not p.name.startswith(".")} if folder.exists() else {}
    own = {
        n for n, data in files.items() if n in there and there[n].is_file() and there[n].read_bytes() == data
    }
    editable = {FILENAME} if own >= set(files) - {FILENAME} else set()
    return sorted(set(there) - own - editable - {"results"})


def is_changed(campaign: Path) -> bool:
    """Whether the campaign of a copy is not the demo's any more."""
    return campaign.read_bytes() != (demo_source() / FILENAME).read_bytes()
