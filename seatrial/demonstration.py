"""The small campaign that comes with the program."""

from __future__ import annotations

import shutil
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
    """Copy the demo campaign.

    Parameters
    ----------
    out : Path
        A new folder, an empty one, or one that holds a copy from before.

    Returns
    -------
    Path
        Its campaign file.

    Raises
    ------
    UsageError
        ``out`` holds something else.
    """
    source = demo_source()
    check_folder(out, "--out")
    own = {p.name for p in source.iterdir()} | {"results"}
    foreign = sorted(p.name for p in out.iterdir() if p.name not in own) if out.exists() else []
    if foreign:
        raise UsageError(f"--out: {out} holds '{foreign[0]}', which is not of the demo. Give a new folder.")
    shutil.copytree(
        source, out, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".*", "__pycache__", "results")
    )
    return out / FILENAME
