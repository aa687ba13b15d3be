"""All formats, in one tuple; each family of formats is a package with its own ``READERS``."""

from __future__ import annotations

from ingest import canbus, marine, mavlink, ros, tabular
from ingest.reader import Reader

READERS: tuple[Reader, ...] = (
    *mavlink.READERS,
    *canbus.READERS,
    *marine.READERS,
    *ros.READERS,
    *tabular.READERS,
)
