"""Clocks that jump back, stand still or leave gaps: found, repaired where it is safe, and said."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import SOURCE, Finding

#: A clock that goes back by more than this, and stays back, has been set or restarted; by less, records are late.
RESTART_NS = 1_000_000_000
#: A gap is an interval this many times the usual one, and at least half a second.
GAP_FACTOR, GAP_NS = 5.0, 500_000_000


def continue_clock(
    t_ns: NDArray[np.int64], topic: str | None = None
) -> tuple[NDArray[np.int64], list[Finding]]:
    """Make a clock continuous over restarts, in the order of recording.

    Where the clock goes back by more than a second and stays back, all that follows is moved on so that it goes on
    one usual interval after the last record before. Records that are merely late are left as they are.

    Parameters
    ----------
    t_ns : (n,) int64
        Times in the order of recording.
    topic : str, optional
        For the findings.

    Returns
    -------
    t_ns : (n,) int64
    findings : list of Finding
        One ``"clock"`` finding per restart.
    """
    steps = np.diff(t_ns)
    back = np.flatnonzero(steps < -RESTART_NS) + 1
    restarts = [i for i in back if stays_back(t_ns, int(i))]
    if not restarts:
        return t_ns, []
    usual = int(np.median(steps[steps > 0])) if (steps > 0).any() else 1
    out = t_ns.copy()
    findings = []
    for i in restarts:
        shift = int(out[i - 1]) + usual - int(out[i])
        out[i:] += shift
        message = f"the clock went back by {-steps[i - 1] * 1e-9:.3f} s; what follows was moved on"
        findings.append(Finding("clock", message, topic=topic))
    return out, findings


def stays_back(t_ns: NDArray[np.int64], i: int, look: int = 16) -> bool:
    """Whether most of the next few records are still behind the record before ``i``."""
    return bool(np.median(t_ns[i : i + look]) < t_ns[i - 1])


def in_order(topic: str, table: pd.DataFrame) -> tuple[pd.DataFrame, list[Finding]]:
    """The table with its index sorted (stable), and a finding where it was not."""
    t = table.index.to_numpy()
    late = int((np.diff(t) < 0).sum())
    if not late:
        return table, []
    message = f"{late} records go back in time; sorted"
    return table.iloc[np.argsort(t, kind="stable")], [Finding("clock", message, topic=topic, count=late)]


def timing_findings(tables: Mapping[str, pd.DataFrame]) -> list[Finding]:
    """Gaps in regular topics and records that were logged twice."""
    return [f for topic, table in tables.items() for f in (*gaps(topic, table), *duplicates(topic, table))]


def gaps(topic: str, table: pd.DataFrame) -> list[Finding]:
    """One finding for the gaps of a topic that comes regularly."""
    if len(table) < 20:
        return []
    t = np.unique(table.index.to_numpy())
    steps = np.diff(t)
    if len(steps) < 10 or np.quantile(steps, 0.75) > 3.0 * np.median(steps):
        return []
    wide = np.flatnonzero(steps > max(GAP_FACTOR * float(np.median(steps)), GAP_NS))
    if not len(wide):
        return []
    longest = wide[np.argmax(steps[wide])]
    message = (
        f"{len(wide)} gap{'s' if len(wide) > 1 else ''}, the longest {steps[longest] * 1e-9:.2f} s"
        f" after {(t[longest] - t[0]) * 1e-9:.2f} s"
    )
    return [Finding("gap", message, topic=topic, count=len(wide))]


def duplicates(topic: str, table: pd.DataFrame) -> list[Finding]:
    """One finding for records equal to the one before in time and in every column."""
    t = table.index.to_numpy()
    same = np.flatnonzero(np.diff(t) == 0) + 1
    for column in table.columns:
        if not len(same):
            return []
        values = table[column].to_numpy()
        now, before = values[same], values[same - 1]
        equal = (now == before) | ((now != now) & (before != before))
        same = same[np.asarray(equal, dtype=bool)]
    return (
        [Finding("duplicate", f"{len(same)} records were logged twice", topic=topic, count=len(same))]
        if len(same)
        else []
    )


def split_by_source(table: pd.DataFrame) -> list[pd.DataFrame]:
    """One table per device, or the table itself."""
    if SOURCE not in table.columns:
        return [table]
    return [rows for _, rows in table.groupby(SOURCE, sort=True)]
