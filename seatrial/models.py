"""Identified models, read back from where a run left them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from ingest.errors import UsageError

if TYPE_CHECKING:
    from identify.fit import Fit

MODEL = "model.json"


def load_model(path: str | os.PathLike[str]) -> Fit:
    """Read an identified model.

    Parameters
    ----------
    path : path-like
        A ``model.json``, the results folder that holds one, or the folder that holds that.

    Raises
    ------
    UsageError
        There is no such file, or it holds no model.
    """
    from validate.report.model_file import read_model

    given = Path(path)
    for file in (given, given / MODEL, given / "results" / MODEL):
        if file.is_file():
            return read_model(file)
    raise UsageError(f"{given}: no {MODEL} is there. `seatrial run` writes one into its results folder.")
