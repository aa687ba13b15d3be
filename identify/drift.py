"""A sensor whose errors wander: what of it is known is taken off as it comes (``identify.innovations``).

A satellite receiver's errors drift beside their white part (first-order Gauss-Markov). The smoother has told the drift
from the motion (``preprocess.wander``), whatever model there is; a compass's and a gyro's tell each other
(``preprocess.compass``), a velocity's the positions (``preprocess.receiver``). Against the motion of an agile vessel a
small one shows only in the errors of a fit that is near the noise (``identify.wander``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.innovations import Process
from identify.kernel import POSITION, VELOCITY

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


@dataclass(frozen=True)
class Drift:
    """Standard deviation of a drift, along each axis or of the angle, SI, its time constant, s, and what drifts.

    ``shown``: by the errors of a fit, not told from the motion before there was one.
    """

    size: float
    time: float
    kind: int = POSITION
    shown: bool = False

    def process(self, since: FloatArray, kind: IntArray) -> Process:
        """Its states (north and east, or the angle) at samples (m,) of these kinds, ``since`` the one before, s."""
        axes = 2 if self.kind in (POSITION, VELOCITY) else 1
        kept = np.exp(-since / self.time)
        noise = self.size**2 * (1.0 - kept**2)
        own = np.repeat(np.arange(axes)[:, None], 2, axis=1)
        seen = (kind == self.kind)[:, None, None] * np.eye(2)[:, :axes]
        carried, added = (np.repeat(x[:, None], axes, axis=1) for x in (kept, noise))
        return Process(own, carried, own, added, seen, self.size**2 * np.eye(axes))


def drifting(drifts: Sequence[Drift], times: FloatArray) -> tuple[Drift, ...]:
    """The drifts, each kind's (4,) so many ``times`` as large."""
    return tuple(replace(d, size=float(times[d.kind]) * d.size) for d in drifts)
