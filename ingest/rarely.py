"""Samples that come too rarely for a vessel: their times are in another unit than the one that they were read in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Samples that come this far apart, s, are too rare for any vessel, and those no farther apart than this too many.
RARE, SWARMING = 5.0, 2e-3
#: Units that times are in where they are no seconds: what a column's name ends in, its name, and how long it is, s.
SMALLER = (("ms", "milliseconds", 1e-3), ("us", "microseconds", 1e-6), ("ns", "nanoseconds", 1e-9))


def usual_step(t: NDArray[np.generic]) -> float:
    """The median step of times (n,) in whatever order, in their unit; 0 where there is none."""
    steps = np.diff(np.unique(t.astype(float)))
    return float(np.median(steps)) if len(steps) else 0.0


def smaller_units(step: float) -> list[str]:
    """The units in which a step that is ``step`` s long as it was read would be one of a vessel's log."""
    return [code for code, _, size in SMALLER if SWARMING <= step * size < RARE]


def to_be_called(step: float, stem: str = "t") -> str:
    """How a column is to be called whose times come ``step`` s apart as they were read; empty where nothing fits."""
    fitting = [(name, f"{stem}_{code}") for code, name, _ in SMALLER if code in smaller_units(step)]
    if not fitting:
        return ""
    names, calls = (" or ".join(words) for words in zip(*fitting, strict=True))
    return f"Where its times are in {names}, their column is to be called so: {calls}."
