"""What is known while sailing: the sensors' noise, the parameters, and how surely."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


@dataclass(frozen=True)
class Noise:
    """What the errors of each stream count, (4,) each: position, heading, yaw rate, velocity.

    ``sigma`` is the white noise, SI; ``inflation`` and ``dispersion`` as in `identify.windows.Problem`.
    """

    sigma: FloatArray
    inflation: FloatArray = field(default_factory=lambda: np.ones(4))
    dispersion: FloatArray = field(default_factory=lambda: np.ones(4))


@dataclass(frozen=True)
class Knowledge:
    """What is known of the parameters from windows that have left the horizon.

    ``information`` (np, np) and ``vector`` (np,) of the cost pᵀ I p - 2 vᵀ p; ``dispersed`` (np, np) the information
    with errors counted as they are at low frequency; ``at`` the time, s, to which forgetting has been reckoned.
    """

    information: FloatArray
    vector: FloatArray
    dispersed: FloatArray
    at: float = 0.0

    def faded(self, factor: float) -> Knowledge:
        """The same, worth ``factor`` as much."""
        return replace(
            self,
            information=factor * self.information,
            vector=factor * self.vector,
            dispersed=factor * self.dispersed,
        )

    def later(self, at: float, forget: float) -> Knowledge:
        """What is left of it at a later time."""
        return replace(self.faded(math.exp(-max(at - self.at, 0.0) / forget)), at=at)


@dataclass(frozen=True)
class Estimate:
    """Parameters (np,), and the information on them with errors as they are at low frequency, prior included."""

    p: FloatArray
    information: FloatArray

    @property
    def covariance(self) -> FloatArray:
        """(np, np)."""
        scale = 1.0 / np.sqrt(np.maximum(np.diag(self.information), 1e-300))
        inverse = np.linalg.pinv(self.information * scale * scale[:, None], rcond=1e-12, hermitian=True)
        return np.asarray(inverse * scale * scale[:, None], dtype=float)


def nothing_known(size: int) -> Knowledge:
    """No information on ``size`` parameters."""
    return Knowledge(np.zeros((size, size)), np.zeros(size), np.zeros((size, size)))
