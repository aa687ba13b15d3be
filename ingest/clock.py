"""Clocks that jump back, stand still or leave gaps: found, repaired where it is safe, and said."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import Finding

#: A clock that goes back by more than this, and stays back, has been set or restarted; by less, records are
#: late.
RESTART_NS = 1_000_000_000
#: A time that differs by more than this from the median of its neighbours is broken.
STRAY_NS = 1_000_000_000
#: … and by more than so many usual steps.
STRAY_STEPS = 5.0
#: A step forward as large as this is looked at, too.
LEAP_NS = 3_600_000_000_000
#: No time is earlier or later (1896 and 2189, as UTC), so that the difference of two always fits.
EARLIEST_NS, LATEST_NS = -(1 << 61), (3 << 61) - 1
#: A sliding look at so many records tells a clock that stays back from late records.
LOOK = 16
#: A clock restarts at most once in so many records; one that seems to do so more often has records in no order.
RARELY = 10
#: So many restarts are reported one by one.
MOST_RESTARTS = 100
#: A gap is an interval this many times the usual one, and at least half a second.
GAP_FACTOR, GAP_NS = 5.0, 500_000_000


def continue_clock(
    t_ns: NDArray[np.int64], topic: str | None = None
) -> tuple[NDArray[np.int64], list[Finding]]:
    """Make a clock continuous over restarts, in the order of recording.

    Where the clock goes back by more than a second and stays back, all that follows is moved on so that it
    goes on one usual interval after the last record before. Records that are merely late are left as they
    are, and so are those of a table that somebody has shuffled: they are sorted by time.

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
    t_ns = believable(t_ns)
    steps = np.diff(t_ns)
    restarts = staying_back(t_ns, np.flatnonzero(steps < -RESTART_NS) + 1)
    if not len(restarts) or RARELY * len(restarts) > len(t_ns):
        return t_ns, []
    usual = int(np.median(steps[steps > 0])) if (steps > 0).any() else 1
    shifts = shifts_after(t_ns, restarts, usual)
    moved = np.repeat(shifts, np.diff([*restarts, len(t_ns)]))
    late = t_ns[restarts[0] :]
    out = np.concatenate([t_ns[: restarts[0]], np.minimum(late, LATEST_NS - moved) + moved])
    return out, restart_findings(steps[restarts - 1], topic)


def staying_back(t_ns: NDArray[np.int64], back: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those steps back after which most of the next few records are still behind the record before."""
    if not len(back):
        return back
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(t_ns, (0, LOOK - 1), mode="edge"), LOOK)
    return np.asarray(back[np.median(windows[back], axis=1) < t_ns[back - 1]])


def shifts_after(t_ns: NDArray[np.int64], restarts: NDArray[np.int64], usual: int) -> NDArray[np.int64]:
    """By how much each stretch that starts with a restart must be moved on."""
    jumps = (int(t_ns[i - 1]) + usual - int(t_ns[i]) for i in restarts)
    total, shifts = 0, []
    for jump in jumps:
        total = min(total + jump, LATEST_NS)
        shifts.append(total)
    return np.array(shifts, dtype=np.int64)


def restart_findings(steps: NDArray[np.int64], topic: str | None) -> list[Finding]:
    """One finding per restart, and one for the rest if there are very many."""
    findings = [
        Finding(
            "clock", f"the clock went back by {-int(s) * 1e-9:.3f} s; what follows was moved on", topic=topic
        )
        for s in steps[:MOST_RESTARTS]
    ]
    if len(rest := steps[MOST_RESTARTS:]):
        findings.append(Finding("clock", f"{len(rest)} more restarts", topic=topic, count=len(rest)))
    return findings


def believable(t_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Clip times to where sums and differences of two still fit; good times are far inside."""
    if len(t_ns) and (int(t_ns.min()) < EARLIEST_NS or int(t_ns.max()) > LATEST_NS):
        return np.clip(t_ns, EARLIEST_NS, LATEST_NS)
    return t_ns


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
    before = np.clip(np.searchsorted(good, bad) - 1, 0, None)
    after = np.minimum(before + 1, len(good) - 1)
    restart = t_ns[good[after]] < t_ns[good[before]] - RESTART_NS
    out[bad[restart]] = t_ns[good[before[restart]]]  # nothing lies between the end of one log and the next
    message = f"{len(bad)} broken time stamps; their times were taken from the neighbours'"
    return out, [Finding("clock", message, offset=max(int(offset[bad[0]]), 0), count=len(bad))]


def without_strays(t_ns: NDArray[np.int64]) -> tuple[NDArray[np.int64], list[Finding]]:
    """The same of a table's rows, whose places in a file nobody knows; one that somebody shuffled is left alone."""
    wrong = strays(t_ns, np.zeros(len(t_ns), dtype=bool))
    if RARELY * wrong.sum() > len(t_ns):
        return t_ns, []
    out, findings = mended(t_ns, wrong, np.zeros(len(t_ns), dtype=np.int64))
    return out, [replace(f, offset=None) for f in findings]


def strays(t_ns: NDArray[np.int64], broken: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Find times that differ from the median of five neighbours where time does not go on; (n,) bool.

    Differ: by more than a second, and than a few usual steps. Two in a row that go on from one to the other are none.
    """
    out = np.zeros(len(t_ns), dtype=bool)
    good = np.flatnonzero(~broken)
    if len(good) < 5:
        return out
    t = t_ns[good]
    suspects = np.flatnonzero(uneasy(t))
    if not len(suspects):
        return out
    steps = np.diff(t)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(t, 2, mode="reflect"), 5)[suspects]
    off = np.abs(t[suspects] - np.median(windows, axis=1)) > max(STRAY_NS, STRAY_STEPS * usual)
    goes_on = np.concatenate([[False], (steps >= 0) & (steps < STRAY_NS), [False]])
    out[good[suspects[off & ~goes_on[suspects] & ~goes_on[suspects + 1]]]] = True
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
    t = table.index.to_numpy(dtype=np.int64)
    if (clipped := believable(t)) is not t:
        table, t = table.set_axis(clipped, axis=0), clipped
    late = int((t < np.maximum.accumulate(t)).sum())
    if not late:
        return table, []
    message = f"{late} {'record goes' if late == 1 else 'records go'} back in time; sorted"
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
        [
            Finding(
                "duplicate",
                f"{len(same)} {'record was' if len(same) == 1 else 'records were'} logged twice",
                topic=topic,
                count=len(same),
            )
        ]
        if len(same)
        else []
    )
