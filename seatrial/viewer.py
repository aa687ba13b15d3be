"""The Rerun viewer on a recording."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ingest.errors import UsageError, nearest
from ingest.looks import looks_like

RECORDING = "recording.rrd"
#: First bytes of every version of the format.
MAGIC = b"RRF"


def recording_in(path: Path) -> Path:
    """The recording that a path means: itself, or the one of a results folder.

    Raises
    ------
    UsageError
        There is none, or the file is something else.
    """
    for file in (path, path / RECORDING, path / "results" / RECORDING):
        if file.is_file():
            return checked_recording(file)
    there = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
    near = nearest(path.name, there)
    hint = f" Nearest there: {', '.join(near)}." if near and not path.exists() else ""
    raise UsageError(
        f"{path}: no {RECORDING} is there.{hint} `seatrial run` writes one into its results folder."
    )


def checked_recording(file: Path) -> Path:
    """The file itself, if it begins as Rerun's recordings do."""
    with file.open("rb") as stream:
        head = stream.read(4096)
    if not head.startswith(MAGIC):
        found = looks_like(head, file.stat().st_size)
        raise UsageError(f"{file}: expected a recording of Rerun, found {found}.")
    return file


def viewer_environment(web: bool = False) -> dict[str, str]:
    """The viewer's environment: unless asked for more it logs errors alone, and the address for a browser."""
    told = "error,re_sdk::web_viewer=info" if web else "error"
    return {"RUST_LOG": told} | os.environ


def viewer_command(recording: Path, web: bool = False) -> list[str]:
    """The command that opens a recording, bound to this machine alone."""
    mode = ["--web-viewer"] if web else []
    return [sys.executable, "-m", "rerun", "--bind", "127.0.0.1", *mode, str(recording)]
