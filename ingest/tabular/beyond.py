"""Cells that hold no quantity although they read as numbers: infinite ones, and those beyond anything measured."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ingest.codes import LARGEST
from ingest.log import Finding


def without_beyond(table: pd.DataFrame, topic: str) -> tuple[pd.DataFrame, list[Finding]]:
    """The table with such cells empty, and a finding for each column that had any."""
    floats = [c for c in table.columns if pd.api.types.is_float_dtype(table[c])]
    beyond = {c: np.abs(table[c].to_numpy(float, na_value=np.nan)) > LARGEST for c in floats}
    bad = {c: int(cells.sum()) for c, cells in beyond.items() if cells.any()}
    if not bad:
        return table, []
    findings = [
        Finding("damaged", f"{n} cells of '{c}' are infinite or beyond {LARGEST:g}", topic=topic, count=n)
        for c, n in bad.items()
    ]
    return table.assign(**{str(c): table[c].mask(beyond[c]) for c in bad}), findings
