"""Clocks that jump back, stand still or leave gaps: found, repaired where it is safe, and said."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import Finding

#: A clock that goes back by more than this, and stays back, has been set or restarted; by less, records are
#: late.
RESTART_NS = 1_000_000_000
#: A time that differs by more than this from the median of its neighbours is broken.
STRAY_NS = 1_000_000_000
#: A step forward as large as this is looked at, too.
LEAP_NS = 3_600_000_000_000
#: A gap is an interval this many times the usual one, and at least half a second.
GAP_FACTOR, GAP_NS = 5.0, 500_000_000


def continue_clock(
    t_ns: NDArray[np.int64], topic: str | None = None
) -> tuple[NDArray[np.int64], list[Finding]]:
    """Make a clock continuous over restarts, in the order of recording.

    Where the clock goes back by more than a second and stays back, all that follows is moved on so that it
    goes on one usual interval after the last record before. Records that are merely late are left as they
    are.

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


def mended(
    t_ns: NDArray[np.int64], broken: NDArray[np.bool_], offset: NDArray[np.int64]
) -> tuple[NDArray[np.int64], list[Finding]]:
    """Interpolate times that are broken, or stray from their neighbours'.

    Parameters
    ----------
    t_ns : (n,) int64
        In the order of recording.
    broken : (n,) bool
        Known to be broken.
    offset : (n,) int64
        Where each stands in the file, for the finding.

    Returns
    -------
    t_ns : (n,) int64
        Zero throughout if all are broken.
    findings : list of Finding
    """
    broken = broken | strays(t_ns, broken)
    if not broken.any():
        return t_ns, []
    if broken.all():
        return np.zeros_like(t_ns), [Finding("clock", "no record has a valid time", count=len(t_ns))]
    good, bad = np.flatnonzero(~broken), np.flatnonzero(broken)
    base = t_ns[good[0]]
    out = t_ns.copy()
    out[bad] = base + np.interp(bad, good, (t_ns[good] - base).astype(float)).astype(np.int64)
    message = f"{len(bad)} broken time stamps; their times were taken from the neighbours'"
    return out, [Finding("clock", message, offset=max(int(offset[bad[0]]), 0), count=len(bad))]


def strays(t_ns: NDArray[np.int64], broken: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Find times that differ from the median of five neighbours where time does not go on; (n,) bool."""
    out = np.zeros(len(t_ns), dtype=bool)
    good = np.flatnonzero(~broken)
    if len(good) < 5:
        return out
    t = t_ns[good]
    suspects = np.flatnonzero(uneasy(t))
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(t, 2, mode="reflect"), 5)[suspects]
    off = np.abs(t[suspects] - np.median(windows, axis=1))
    out[good[suspects[off > STRAY_NS]]] = True
    return out


def uneasy(t_ns: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Give samples within two of a step back or of a very large step; (n,) bool."""
    steps = np.diff(t_ns)
    jump = np.concatenate([[False], (steps < 0) | (steps > LEAP_NS)])
    near = jump.copy()
    for k in (1, 2):
        near[:-k] |= jump[k:]
        near[k:] |= jump[:-k]
    return near


def in_order(topic: str, table: pd.DataFrame) -> tuple[pd.DataFrame, list[Finding]]:
    """Give the table with its index sorted (stable), and a finding where it was not."""
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
    t = table.index.to_numpy()
    steps = np.diff(t)
    rising = steps[steps > 0]
    if len(rising) < 10:
        return []
    usual = float(np.median(rising))
    wide = np.flatnonzero(steps > max(GAP_FACTOR * usual, GAP_NS))
    if not len(wide) or np.mean(rising > 3.0 * usual) > 0.25:
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
