"""At which speed and with which inputs a model was identified, where only the run's predictions still say it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from identify.fit import Fit

#: The reference speed of terms in Δu is this quantile of the speed over the logs identified on.
QUANTILE = 0.9


def with_operating_point(fit: Fit, model: Path) -> Fit:
    """The fit with its inputs' values and its speeds from ``predictions`` beside its file, where it lacks them."""
    folder = (model if model.is_dir() else model.parent) / "predictions"
    files = sorted(folder.glob("*.parquet")) if folder.is_dir() else []
    if not files or (fit.typical_inputs and fit.largest_inputs and fit.speeds and fit.u0 is not None):
        return fit
    import pandas as pd

    names = [i.name for i in fit.inputs]
    parts = [pd.read_parquet(f, columns=["role", "u", *names]) for f in files]
    rows = pd.concat(parts, ignore_index=True)
    rows = rows[(rows["role"] == "identify") & rows["u"].notna()]
    if rows.empty:
        return fit
    typical = {n: float(rows[n].median()) for n in names}
    largest = {n: float(rows[n].abs().max()) for n in names}
    u0 = float(np.quantile(rows["u"], QUANTILE))
    return replace(
        fit,
        typical_inputs=fit.typical_inputs or typical,
        largest_inputs=fit.largest_inputs or largest,
        u0=u0 if fit.u0 is None else fit.u0,
        speeds=fit.speeds or (float(rows["u"].min()), float(rows["u"].max())),
    )
