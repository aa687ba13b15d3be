"""Tables that were decoded piece by piece, below each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd


def stacked(tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Tables below each other; texts stay categories, columns that one lacks are missing there.

    Parameters
    ----------
    tables : sequence of DataFrame
        At least one; the index of each is kept.
    """
    if len(tables) == 1:
        return tables[0]
    index = pd.Index(np.concatenate([t.index.to_numpy() for t in tables]), name=tables[0].index.name)
    names = list(dict.fromkeys(c for t in tables for c in t.columns))
    return pd.DataFrame({name: _column(tables, name) for name in names}).set_axis(index, axis=0)


def _column(tables: Sequence[pd.DataFrame], name: str) -> pd.Series:
    pieces = [t[name] if name in t else pd.Series(np.nan, index=t.index) for t in tables]
    if not any(isinstance(p.dtype, pd.CategoricalDtype) or p.dtype == object for p in pieces):
        return pd.concat(pieces, ignore_index=True)
    return pd.concat([p.astype(object) for p in pieces], ignore_index=True).astype("category")
