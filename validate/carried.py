"""What the error of its first state makes of a free run: the model carries it on, from sway to turning to heading."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from identify.drive import drive
from identify.predict import run, shown, true_first_state
from identify.stretch import Stretch
from identify.structure import Structure
from preprocess.signals import STATES

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Places of u, v and r in a state.
VELOCITIES = (3, 4, 5)


def carried_on(structure: Structure, p: FloatArray, stretch: Stretch) -> FloatArray:
    """Standard deviation (steps + 1, 6) of a free run's x, y, psi, u, v, r by that of its first u, v and r.

    To first order; NaN where a run from beside them runs away.
    """
    d = drive(structure, p, stretch)
    first = true_first_state(structure, d, stretch)
    moves = [np.zeros(len(first))] + [
        sigma * (np.arange(len(first)) == k)
        for k, sigma in zip(VELOCITIES, stretch.sigmas[0], strict=True)
        if np.isfinite(sigma)
    ]
    with np.errstate(over="ignore", invalid="ignore"):
        runs = [shown(structure, d, stretch, run(structure, d, stretch, first + move)) for move in moves]
        return np.asarray(np.sqrt(np.sum([(other - runs[0]) ** 2 for other in runs], axis=0)), dtype=float)


def carried_tables(
    structure: Structure, p: FloatArray, stretches: Sequence[Stretch], tables: Mapping[str, pd.DataFrame]
) -> dict[str, pd.DataFrame]:
    """Per log: ``t`` and that standard deviation of every state, on the rows of the predictions."""
    out = {}
    for name, table in tables.items():
        t = table["t"].to_numpy()
        spread = np.full((len(t), len(STATES)), np.nan)
        for s in (s for s in stretches if s.name == name):
            inside = (t >= s.grid[0] - 1e-9) & (t <= s.grid[-1] + 1e-9)
            columns = carried_on(structure, p, s).T
            spread[inside] = np.column_stack([np.interp(t[inside], s.grid, c) for c in columns])
        out[name] = pd.DataFrame({"t": t, **dict(zip(STATES, spread.T, strict=True))})
    return out
