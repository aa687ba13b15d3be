"""Identified models, read back from where a run left them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from ingest.errors import UsageError

if TYPE_CHECKING:
    from identify.fit import Fit


def load_model(path: str | os.PathLike[str]) -> Fit:
    """Read an identified model.

    Parameters
    ----------
    path : path-like
        A ``model.json``, or the results folder that holds one.

    Raises
    ------
    UsageError
        There is no such file, or it holds no model.
    """
    from validate.report.model_file import read_model

    file = Path(path) / "model.json" if Path(path).is_dir() else Path(path)
    if not file.is_file():
        raise UsageError(
            f"{file}: the model is not there. `seatrial run` writes one into its results folder."
        )
    return read_model(file)
