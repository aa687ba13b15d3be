"""Grid search, refined around its best cell: how cross-validation chooses hyper-parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .state import FloatArray, Optimiser, State, StopReason, common, scattered, to_unit

LARGEST_GRID_DIMENSION = 3


@dataclass(frozen=True)
class GridState(State):
    """The box in which the next grid is laid, within the unit box.

    Attributes
    ----------
    box : (d, 2)
    points : int
        Per variable.
    """

    points: int
    finest: float
    box: FloatArray


def start(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    points: int | None = None,
    finest: float = 1e-4,
) -> GridState:
    """Begin a search.

    Parameters
    ----------
    points : int, optional
        Per variable and round; 10, 5 and 4 for one, two and three variables where absent. In more variables
        the round is a random (Latin hypercube) one of 20 points per variable.
    finest : float
        Width of the last box, as a share of the bounds' width.
    """
    shared = common(bounds, seed)
    d = len(shared["bounds"])
    standard = {1: 10, 2: 5, 3: 4}.get(d, 20)
    return GridState(
        **shared, points=max(points or standard, 3), finest=finest, box=np.tile([0.0, 1.0], (d, 1))
    )


def propose(state: GridState, random: np.random.Generator) -> tuple[GridState, FloatArray]:
    """One grid over the box."""
    low, high = state.box.T
    d = len(low)
    if d > LARGEST_GRID_DIMENSION:
        unit = scattered(random, state.points * d, d)
    else:
        axes = np.meshgrid(*[np.linspace(0, 1, state.points)] * d, indexing="ij")
        unit = np.stack([a.ravel() for a in axes], axis=1)
    return state, low + unit * (high - low)


def learn(state: GridState, unit: FloatArray, values: FloatArray, _: np.random.Generator) -> GridState:
    """Lay the next box around the best point: one cell to each side, or 0.7 of the box if random."""
    if not np.isfinite(state.best_value):
        return state
    best = to_unit(state, state.best_x[None, :])[0]
    width = state.box[:, 1] - state.box[:, 0]
    half = width / (state.points - 1) if len(width) <= LARGEST_GRID_DIMENSION else 0.35 * width
    low = np.clip(best - half, 0.0, 1.0)
    return replace(state, box=np.stack([low, np.clip(best + half, 0.0, 1.0)], axis=1))


def stopped(state: GridState) -> StopReason | None:
    """Fine enough."""
    width = float(np.max(state.box[:, 1] - state.box[:, 0]))
    return StopReason.RESOLVED if width < state.finest else None


CV = Optimiser(
    "cv", start, propose, learn, stopped, "grid search as in Zhu et al. 2019, V.A, refined by rounds"
)
