"""``seatrial view``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    results: Annotated[Path, typer.Argument(help="Results folder, or a recording (.rrd).")],
    web: Annotated[bool, typer.Option("--web", help="Show it in the browser, not in a window.")] = False,
) -> None:
    """Open the recording of a run in Rerun; nothing but this machine can reach it.

    Example:

        seatrial view seatrial-demo/results
    """
    import subprocess

    from ingest.errors import DataError
    from seatrial.viewer import recording_in, viewer_command, viewer_environment

    command = viewer_command(recording_in(results), web)
    status = subprocess.run(command, check=False, env=viewer_environment(web)).returncode
    if status:
        raise DataError(
            f"the Rerun viewer ended with status {status}; without a screen, `--web` shows it in a browser."
        )
