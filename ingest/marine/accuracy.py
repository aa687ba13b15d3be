"""What ``GST`` says of the errors of a fix, beside the fix that it is about."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

#: Sentences of position that a ``GST`` of the same receiver describes.
FIXES = ("GGA", "GNS", "RMC", "GLL")
#: A statement of the errors holds for fixes within so many seconds of it.
HOLDS_S = 1.5


def with_accuracy(tables: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Give the tables, those of fixes with ``accuracy``: standard deviation per axis, m, from the nearest ``GST``.

    It is the root mean square of those of latitude and longitude; NaN where no ``GST`` is near.
    """
    stated = tables.get("GST")
    if stated is None or not {"stdLat", "stdLong"} <= set(stated.columns):
        return dict(tables)
    sigma = np.sqrt(0.5 * (stated["stdLat"].to_numpy(float) ** 2 + stated["stdLong"].to_numpy(float) ** 2))
    t = stated.index.to_numpy(np.int64)
    order = np.argsort(t, kind="stable")
    series = pd.Series(sigma[order], index=t[order]).dropna()
    series = series[~series.index.duplicated()]
    if not len(series):
        return dict(tables)
    return {n: _beside(v, series) if n in FIXES and len(v) else v for n, v in tables.items()}


def _beside(table: pd.DataFrame, sigma: pd.Series) -> pd.DataFrame:
    """The table with the nearest of ``sigma``, an index of nanoseconds, beside each row."""
    t, known = table.index.to_numpy(np.int64), sigma.index.to_numpy(np.int64)
    after = np.clip(np.searchsorted(known, t), 0, len(known) - 1)
    before = np.maximum(after - 1, 0)
    near = np.where(np.abs(known[after] - t) < np.abs(t - known[before]), after, before)
    holds = np.abs(known[near] - t) <= HOLDS_S * 1e9
    return table.assign(accuracy=np.where(holds, sigma.to_numpy(float)[near], np.nan))
