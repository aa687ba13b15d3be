"""Sizes that an input has: between two of them, what only asks whether it passes some size changes nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A size that an input passes is looked for up to this share of its largest, from so many starts at most.
LARGEST, MOST_STARTS = 0.6, 12


def sizes_of(stretches: Sequence[Stretch], *names: str) -> FloatArray:
    """Sizes (n,) of some inputs in all stretches, each once, in order."""
    inputs = [s.inputs[name] for s in stretches for name in names]
    return np.asarray(
        np.unique(np.abs(np.concatenate([m.value[m.good] for m in inputs])).round(9)), dtype=float
    )


def between(sizes: FloatArray, most: float = np.inf) -> list[float]:
    """Places between the smaller ones of some sizes, a few of them, none above ``most``."""
    small = sizes[sizes < LARGEST * sizes[-1]] if len(sizes) else sizes
    if len(small) > MOST_STARTS:
        small = np.unique(np.quantile(small, np.linspace(0.0, 1.0, MOST_STARTS)))
    return [float(v) for v in 0.5 * (small[1:] + small[:-1]) if v < most]


def untold(structure: Structure, p: FloatArray, stretches: Sequence[Stretch]) -> FloatArray:
    """Variance (np,) of parameters of which only the two sizes that they lie between are known: uniform there."""
    out = np.zeros(len(p))
    for e, active in enumerate(structure.actives):
        if not active.effect.stepwise or not active.effect.stepwise(active.variant.options):
            continue
        k = next(k for k, s in enumerate(structure.slots) if s.effect == e)
        sizes = sizes_of(stretches, *active.variant.inputs)
        below = sizes[sizes < p[k]].max(initial=0.0)
        above = sizes[sizes > p[k]].min(initial=np.inf)
        out[k] = (above - below) ** 2 / 12.0 if np.isfinite(above) else 0.0
    return out
