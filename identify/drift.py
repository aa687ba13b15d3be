"""A sensor whose errors wander: what of it is known is taken off as it comes (``identify.innovations``).

A satellite receiver's errors drift beside their white part (first-order Gauss-Markov; or smoothly, critically damped of
second order, where its filter leaves them so). The smoother has told the drift from the motion
(``preprocess.wander``), whatever model there is; a compass's and a gyro's tell each other (``preprocess.compass``), a
velocity's and a position's likewise (``preprocess.receiver``). Against the motion of an agile vessel a small one shows
only in the errors of a fit that is near the noise (``identify.wander``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammainc

from identify.innovations import Process
from identify.kernel import POSITION, VELOCITY

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


@dataclass(frozen=True)
class Drift:
    """Standard deviation of a drift, along each axis or of the angle, SI, its time constant, s, and what drifts.

    ``smooth`` where it is critically damped noise of second order, not of first; ``shown``: by the errors of a fit, not
    told from the motion before there was one.
    """

    size: float
    time: float
    kind: int = POSITION
    smooth: bool = False
    shown: bool = False

    def process(self, since: FloatArray, kind: IntArray) -> Process:
        """Its states (north and east, or the angle) at samples (m,) of these kinds, ``since`` the one before, s."""
        axes = 2 if self.kind in (POSITION, VELOCITY) else 1
        if self.smooth:
            return self._smooth(since, kind, axes)
        kept = np.exp(-since / self.time)
        noise = self.size**2 * (1.0 - kept**2)
        own = np.repeat(np.arange(axes)[:, None], 2, axis=1)
        seen = (kind == self.kind)[:, None, None] * np.eye(2)[:, :axes]
        carried, added = (np.repeat(x[:, None], axes, axis=1) for x in (kept, noise))
        return Process(own, carried, own, added, seen, self.size**2 * np.eye(axes))

    def _smooth(self, since: FloatArray, kind: IntArray, axes: int) -> Process:
        """The same of a smooth one: its states, and behind them their rates in units of one over the time constant."""
        x = since / self.time
        kept = np.exp(-x)
        came = gammainc(3.0, 2.0 * x)  # of the states' variance since the sample before
        carried = (kept * (1.0 + x), kept * x, -kept * x, kept * (1.0 - x))
        added = (came, 2.0 * (kept * x) ** 2, came + 4.0 * x * kept**2)
        state, rate = np.arange(axes), axes + np.arange(axes)
        places = np.concatenate(
            [np.column_stack(k) for k in ((state, state), (state, rate), (rate, state), (rate, rate))]
        )
        noise_places = np.concatenate(
            [np.column_stack(k) for k in ((state, state), (state, rate), (rate, rate))]
        )
        seen = np.zeros((len(kind), 2, 2 * axes))
        seen[:, :, :axes] = (kind == self.kind)[:, None, None] * np.eye(2)[:, :axes]
        return Process(
            places, np.repeat(np.column_stack(carried), axes, axis=1), noise_places,
            self.size**2 * np.repeat(np.column_stack(added), axes, axis=1), seen, self.size**2 * np.eye(2 * axes),
        )  # fmt: skip


def drifting(drifts: Sequence[Drift], times: FloatArray) -> tuple[Drift, ...]:
    """The drifts, each kind's (4,) so many ``times`` as large."""
    return tuple(replace(d, size=float(times[d.kind]) * d.size) for d in drifts)
