"""What follows from the fields of a sentence: whether its data are valid, the true heading, a column per transducer."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import SOURCE
from ingest.marine.definitions import INSTANCE

Integers = NDArray[np.int64]
#: Position modes that are measurements (or simulate them); the others are estimated, set by hand, or none. One
#: letter per satellite system in ``GNS``.
MEASURED = frozenset("ADFPRS")


def completed(topic: str, table: pd.DataFrame) -> tuple[pd.DataFrame, Integers | int]:
    """Columns that follow from the others and that detection needs; and which instance each row is of.

    Parameters
    ----------
    topic : str
    table : DataFrame
        Columns as decoded, with the talker.

    Returns
    -------
    table : DataFrame
    instance : (n,) int64 or 0
        Which of several shafts, devices or transducers the row is of, counted from 0.
    """
    good = _good(table)
    if good is not None:
        table["good"] = good
    if topic == "MWV" and "reference" in table:
        table["relative"] = (table["reference"] == "R").to_numpy(bool)
        table["relative_good"] = table["relative"] * table.get("good", 1.0)
    if topic == "HDG":
        table = _true_heading(table)
    if topic == "RSA":
        table = _judged_sides(table)
    if topic == "RPM" and {"source", "engineshaftnum"} <= set(table.columns):
        table = _numbered_shafts(table)
    instance = _instances(table)
    return (_by_transducer(table) if topic == "XDR" else table), instance


def _instances(table: pd.DataFrame) -> Integers | int:
    told = [c for c in INSTANCE if c in table]
    return np.asarray(table.groupby(told, dropna=False, observed=True).ngroup(), np.int64) if told else 0


def _good(table: pd.DataFrame) -> NDArray[np.float64] | None:
    """1 where the sentence says that its data are valid, 0 where not; None where it says nothing."""
    flags = [c for c in ("status", "valid", "mi") if c in table]
    if not flags and "posMode" not in table:
        return None
    good = np.logical_and.reduce(
        [(table[c] == "A").to_numpy(bool) for c in flags] or [np.ones(len(table), bool)]
    )
    if "posMode" in table:
        modes = table["posMode"].astype("category")
        bad = [m for m in modes.cat.categories if not set(str(m)) & MEASURED]
        good &= ~modes.isin(bad).to_numpy(bool)
    return np.asarray(good, float)


def _true_heading(table: pd.DataFrame) -> pd.DataFrame:
    """Add ``headingT``: the magnetic heading with the deviation and variation that the sentence states."""
    if not {"variation", "variationEW", "deviation", "deviationEW"} <= set(table.columns):
        return table
    west = {c: (table[f"{c}EW"] == "W").to_numpy(bool) for c in ("deviation", "variation")}
    east = {c: np.where(w, -1.0, 1.0) * table[c].to_numpy(float) for c, w in west.items()}
    heading = table["headingM"].to_numpy(float) + np.nan_to_num(east["deviation"]) + east["variation"]
    return table.assign(headingT=np.mod(heading, 360.0))


def _judged_sides(table: pd.DataFrame) -> pd.DataFrame:
    """1 or 0 for each of the two rudders of ``RSA``."""
    sides = [s for s in ("stbd", "port") if f"{s}status" in table]
    return table.assign(**{f"{s}good": (table[f"{s}status"] == "A").to_numpy(float) for s in sides})


def _numbered_shafts(table: pd.DataFrame) -> pd.DataFrame:
    """``source``: the number of the shaft, or 100 + that of the engine where a log has both."""
    number = table["engineshaftnum"].fillna(0)
    engine = (table["source"] == "E").to_numpy(bool)
    if engine.any() and not engine.all():
        number = number + 100.0 * engine
    return table.rename(columns={"source": "kind"}).assign(**{SOURCE: number.astype(np.int64)})


def _by_transducer(table: pd.DataFrame) -> pd.DataFrame:
    """One column per transducer, named by its identifier, or by its type where it has none."""
    columns: dict[str, NDArray[np.float64]] = {}
    for suffix in sorted({c.rsplit("_", 1)[-1] for c in table.columns if c.startswith("data_")}):
        name = table.get(f"tdrid_{suffix}", pd.Series(None, index=table.index, dtype=object)).astype(object)
        name = name.where(name.notna(), table[f"tdrtype_{suffix}"].astype(object))
        values = table[f"data_{suffix}"].to_numpy(float)
        for key in name.dropna().unique():
            mine = (name == key).to_numpy(bool)
            column = columns.setdefault(str(key), np.full(len(table), np.nan))
            column[mine] = values[mine]
    rest = [c for c in ("talker", SOURCE) if c in table]
    return pd.DataFrame(columns).join(table[rest])
