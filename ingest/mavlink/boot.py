"""Clocks that count from a system's start: restarts and wrap-arounds of ``time_boot_ms``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import SOURCE, Finding

COLUMN = "time_boot_ms"
#: Steps back by less are messages that overtook one another.
LATE_MS = 2_000
WRAP_MS, NEAR_WRAP_MS = 1 << 32, 60_000


def boot_findings(tables: Mapping[str, pd.DataFrame]) -> list[Finding]:
    """One finding per restart or wrap-around of a system's clock, from the topic with most of its times."""
    best: dict[int, tuple[str, pd.DataFrame]] = {}
    for topic, rows in per_system(tables):
        system = int(rows[SOURCE].iloc[0])
        if system not in best or len(rows) > len(best[system][1]):
            best[system] = topic, rows
    origin = min((int(t.index[0]) for t in tables.values() if len(t)), default=0)
    return [f for system, (topic, rows) in best.items() for f in steps_back(system, topic, rows, origin)]


def per_system(tables: Mapping[str, pd.DataFrame]) -> Iterator[tuple[str, pd.DataFrame]]:
    """Give the rows of each system in each topic that carries the time since its start."""
    for topic, table in tables.items():
        if COLUMN not in table.columns or not len(table):
            continue
        source = table[SOURCE].to_numpy()
        for system in [source[0]] if (source == source[0]).all() else np.unique(source):
            rows = table if len(source) and (source == system).all() else table[source == system]
            yield topic, rows[[SOURCE, COLUMN]]


def steps_back(system: int, topic: str, rows: pd.DataFrame, origin: int) -> Iterator[Finding]:
    """Give findings for the places where the clock goes back."""
    ms = rows[COLUMN].to_numpy(dtype=float)
    t: NDArray[np.int64] = rows.index.to_numpy(dtype=np.int64)
    for i in np.flatnonzero(np.diff(ms) < -LATE_MS) + 1:
        wrapped = ms[i - 1] > WRAP_MS - NEAR_WRAP_MS and ms[i] < NEAR_WRAP_MS
        what = "wrapped around" if wrapped else "started anew"
        message = f"the clock of system {system} {what} {(int(t[i]) - origin) * 1e-9:.1f} s into the log"
        yield Finding("clock", message, topic=topic)
