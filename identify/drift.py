"""A position that wanders: what of it is known is taken off as it comes (``identify.innovations``).

A satellite receiver's errors drift beside their white part (first-order Gauss-Markov). The smoother has told the drift
from the motion (``preprocess.wander``), whatever model there is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.innovations import Process
from identify.kernel import POSITION

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


@dataclass(frozen=True)
class Drift:
    """Standard deviation of a drift, m, along each axis, and its time constant, s."""

    size: float
    time: float

    def process(self, since: FloatArray, kind: IntArray) -> Process:
        """Its two states, north and east, at samples (m,) of these kinds, each so long ``since`` the one before, s."""
        kept = np.exp(-since / self.time)
        noise = self.size**2 * (1.0 - kept**2)
        own = np.array([[0, 0], [1, 1]])
        seen = (kind == POSITION)[:, None, None] * np.eye(2)
        both = (np.column_stack([x, x]) for x in (kept, noise))
        return Process(own, next(both), own, next(both), seen, self.size**2 * np.eye(2))
