"""A log that was recorded, as if it came in now: its tables in short batches, in the order of time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ingest import read_log
from ingest.log import Log
from seatrial.capture.decoders import Tables

#: Length of a batch, s.
BATCH_S = 0.25
#: Topics that a capture writes beside what the ports said.
OWN = ("/capture/", "/online/")


def batches(log: Log, batch_s: float = BATCH_S) -> Iterator[Tables]:
    """The tables of a log, cut into batches; times are those of the log, ns since its first record."""
    tables = {k: t for k, t in log.tables.items() if len(t) and not k.startswith(OWN)}
    stamps = {k: t.index.to_numpy(np.int64) for k, t in tables.items()}
    end = max((int(s[-1]) for s in stamps.values()), default=-1)
    edges = np.arange(0, end + 2 * round(batch_s * 1e9), round(batch_s * 1e9))
    places = {k: np.searchsorted(s, edges) for k, s in stamps.items()}
    for i in range(len(edges) - 1):
        part = {
            k: t.iloc[places[k][i] : places[k][i + 1]]
            for k, t in tables.items()
            if places[k][i] < places[k][i + 1]
        }
        if part:
            yield Tables(part, log.units, log.sources, sum(map(len, part.values())))


def recorded_log(path: Path, dbc: Path | None = None) -> Log:
    """The log in a file."""
    return read_log(path, dbc=dbc)
