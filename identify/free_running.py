"""How far a fit's free runs over whole logs are off, and what that says of it."""

from __future__ import annotations

import numpy as np

from identify.chain import spreads
from identify.fitted import SLOWLY, Fitted
from identify.predict import relative_errors

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A model follows whole logs where the squared free-running errors of u, v, r, each in units of its spread, add up to
#: less than this.
FOLLOWS = 0.5
#: ... and is lost, be it near the noise in windows, where they add up to more than this.
LOST = 5.0


def free_running_misfit(fitted: Fitted) -> float:
    """Mean squared free-running error of u, v, r, each in units of its spread in its own stretch, summed."""
    return float(free_running_errors(fitted).sum())


def is_lost(fitted: Fitted) -> bool:
    """Whether a fit predicts its own logs far worse than their means do, or cannot follow them and slow errors show it.

    Where sensors are poor, or the vessel is slow, its windows may be near the noise all the same: from first state to
    first state anything follows what hardly moves.
    """
    misfit = fitted.remembered(free_running_misfit)
    return misfit > LOST or (misfit > FOLLOWS and fitted.slow > SLOWLY)


def free_running_errors(fitted: Fitted) -> FloatArray:
    """Mean squared free-running error (3,) of u, v, r, each in units of its spread in its own stretch."""
    stretches, structure = fitted.problem.stretches, fitted.solution.structure
    every = [
        np.sum(relative_errors(structure, fitted.solution.p, s, scale) ** 2, axis=0)
        for s, scale in zip(stretches, spreads(stretches), strict=True)
    ]
    return np.asarray(np.sum(every, axis=0) / sum(s.steps + 1 for s in stretches), dtype=float)
