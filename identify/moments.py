"""Moments of windows: what first states, parameters and errors have to do with each other, one window after another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


@dataclass(frozen=True)
class Moments:
    """Per window: moment matrix (8 + np + 1 square: first state, parameters, error), and normalised errors.

    ``raw`` are the errors (m, 2) as they were; ``white`` makes those of a window white, by its number.
    """

    matrices: FloatArray
    raw: tuple[FloatArray, ...]
    white: Callable[[int, FloatArray], FloatArray]

    @cached_property
    def residuals(self) -> tuple[FloatArray, ...]:
        """The errors (m, 2) of every window, white where a problem says what its inputs hide: made when asked for."""
        return tuple(self.white(k, e) for k, e in enumerate(self.raw))

    @property
    def cost(self) -> float:
        """Sum of squared normalised errors; NaN where a prediction ran away."""
        return float(self.matrices[:, -1, -1].sum())

    def of(self, some: slice) -> Moments:
        """Those of some windows."""
        numbers = range(len(self.raw))[some]
        return Moments(self.matrices[some], self.raw[some], lambda k, e: self.white(numbers[k], e))
