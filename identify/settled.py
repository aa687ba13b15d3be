"""The windows' first states at their best, the parameters held: each window for itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.first_states import first_states, state_precision
from identify.moments import Moments
from identify.reduction import reduce
from identify.structure import Structure
from identify.windows import Problem, moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: So many steps are taken at most, and none that promises less than this of the cost in all.
STEPS, TOLERANCE = 4, 0.05


@dataclass(frozen=True)
class Settled:
    """First states (w, 8) for held parameters ``p``, and the moments (w, 9, 9) of what is left."""

    structure: Structure
    p: FloatArray
    first: FloatArray
    moments: Moments

    @property
    def cost(self) -> float:
        """Sum of squared normalised errors; not a number where a window runs away from the first step on."""
        return self.moments.cost


def settled(problem: Problem, structure: Structure, p: FloatArray) -> Settled:
    """Fit the windows' first states alone, from the smoothed motion, by a damped Gauss-Newton search for each.

    Parameters
    ----------
    problem : Problem
    structure : Structure
    p : (np,)
    """
    anchor, known = first_states(problem), state_precision(structure)
    first, now = anchor, moments(problem, structure, p, anchor, held=True)
    damping = np.full(len(anchor), 1e-3)
    for _ in range(STEPS if np.isfinite(now.cost) else 0):
        reduced = reduce(now.matrices, first, anchor, known, damping[:, None])
        if float(np.sum(now.matrices[:, -1, -1] - reduced.cost)) < TOLERANCE:
            break
        there = first + reduced.state_step
        trial = moments(problem, structure, p, there, held=True)
        better = _costs(trial, there - anchor, known) < _costs(now, first - anchor, known)
        first = np.where(better[:, None], there, first)
        now = _chosen(better, trial, now)
        damping = np.where(better, damping * 0.1, damping * 100.0)
    return Settled(structure, p, first, now)


def _costs(found: Moments, away: FloatArray, known: FloatArray) -> FloatArray:
    """Cost (w,) of every window with what is known of its first state."""
    return np.asarray(found.matrices[:, -1, -1] + away**2 @ known, dtype=float)


def _chosen(better: BoolArray, trial: Moments, now: Moments) -> Moments:
    """Of every window the moments of its better first state."""
    matrices = np.where(better[:, None, None], trial.matrices, now.matrices)
    raw = tuple(a if b else c for a, b, c in zip(trial.raw, better, now.raw, strict=True))
    return replace(now, matrices=matrices, raw=raw)
