"""Cases of the ingest benchmark: a module here with a tuple ``CASES`` is found by ``bench_ingest.py``."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Case:
    """One log format against its peer.

    Attributes
    ----------
    name : str
    peer_name : str
        What the peer does, for the table.
    target : float
        Least ratio of speeds; 0 where none is asked for.
    make : callable
        ``make(folder, scale) -> Path``: write a log; ``scale`` 1 takes the peer some ten seconds.
    ours, peer : callable
        ``f(path) -> int``: read it to columns, as a user would; how many records.
    records : callable, optional
        ``records(bytes) -> list of bytes``: cut a good log into its records, for the damage table. The first
        is kept whole (a header).
    checksummed : bool
        Whether a flipped byte makes a record recognisably bad.
    """

    name: str
    peer_name: str
    target: float
    make: Callable[[Path, float], Path]
    ours: Callable[[Path], int]
    peer: Callable[[Path], int]
    records: Callable[[bytes], list[bytes]] | None = None
    checksummed: bool = True


def all_cases() -> list[Case]:
    """Give the cases of all modules here."""
    modules = [importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)]
    return [case for module in modules for case in getattr(module, "CASES", ())]
