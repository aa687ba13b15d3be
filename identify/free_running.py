"""How far a fit's free runs over whole logs are off, and what that says of it."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import uniform_filter1d

from identify.chain import spreads
from identify.fitted import SLOWLY, Fitted
from identify.predict import relative_errors
from identify.stretch import Stretch

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A model follows whole logs where the squared free-running errors of u, v, r, each in units of its spread, add up to
#: less than this.
FOLLOWS = 0.5
#: ... and is lost, be it near the noise in windows, where they add up to more than this.
LOST = 5.0
#: Waves that are known to move the vessel are taken off by the mean over so many of their periods.
PERIODS = 2


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
    """Mean squared free-running error (3,) of u, v, r, each in units of its spread in its own stretch.

    Less what swings with waves that are known: no model can say when they come, and beside them an effect would seem
    to be of no use.
    """
    stretches, structure = fitted.problem.stretches, fitted.solution.structure
    every = [
        np.sum(less_waves(relative_errors(structure, fitted.solution.p, s, scale), s) ** 2, axis=0)
        for s, scale in zip(stretches, spreads(stretches), strict=True)
    ]
    return np.asarray(np.sum(every, axis=0) / sum(s.steps + 1 for s in stretches), dtype=float)


def less_waves(errors: FloatArray, stretch: Stretch) -> FloatArray:
    """Errors (steps + 1, k) of a stretch, averaged over ``PERIODS`` of the waves that are known to move the vessel."""
    if stretch.swell is None:
        return errors
    size = round(PERIODS * 2.0 * math.pi / (stretch.swell.frequency * stretch.h))
    return np.asarray(uniform_filter1d(errors, max(1, size), axis=0, mode="nearest"), dtype=float)
