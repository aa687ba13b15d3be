"""All formats, in one tuple; each family of formats is a package or module with its own ``READERS``."""

from __future__ import annotations

import importlib
import importlib.util

from ingest.reader import Reader

FAMILIES = ("ingest.mavlink", "ingest.canbus", "ingest.marine", "ingest.tabular", "ingest.ros")


def family(module: str) -> tuple[Reader, ...]:
    """The readers of one family; none where it is not there."""
    if importlib.util.find_spec(module) is None:
        return ()
    try:
        readers: tuple[Reader, ...] = getattr(importlib.import_module(module), "READERS", ())
    except ImportError:  # being written
        return ()
    return readers


READERS: tuple[Reader, ...] = tuple(r for module in FAMILIES for r in family(module))
