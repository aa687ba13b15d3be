"""What the commands share with the reader: their options, and medians with their spread."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from identify.estimators.estimate import FloatArray

K = TypeVar("K")
V = TypeVar("V")


@dataclass(frozen=True)
class Options:
    """How many draws of the noise, whether only to see that it works, and whether without the paper's methods."""

    seeds: int
    quick: bool
    ours: bool = False


def chosen_of(table: Mapping[K, V], options: Options) -> list[tuple[K, V]]:
    """The parts of a table; of a quick look the first alone."""
    return list(table.items())[: 1 if options.quick else None]


def command_line(description: str | None, seeds: int = 5, ours: str = "") -> Options:
    """Read ``--seeds`` and ``--quick``, and ``--ours`` where it is explained."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", type=int, default=seeds, help="draws of the noise; medians and spread")
    parser.add_argument(
        "--quick", action="store_true", help="one draw, short runs: only to see that it works"
    )
    if ours:
        parser.add_argument("--ours", action="store_true", help=ours)
    chosen = parser.parse_args()
    return Options(1 if chosen.quick else chosen.seeds, chosen.quick, getattr(chosen, "ours", False))


def spread(values: FloatArray, form: str = ".4g") -> str:
    """Median of the draws, and in brackets the least and the greatest."""
    values = np.asarray(values, dtype=float)
    middle = f"{np.median(values):{form}}"
    return middle if len(values) < 2 else f"{middle} ({values.min():{form}}..{values.max():{form}})"


def row(name: str, cells: list[str], width: int = 16, first: int = 24) -> None:
    """Print one line of a table."""
    print(f"{name:{first}}" + "".join(f"{cell:>{width}}" for cell in cells), flush=True)
