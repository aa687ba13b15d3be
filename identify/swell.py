"""Waves that are known to be there, as what they leave open in every window's predictions.

Waves move a vessel whatever it does; no model can say when. Once their band is known, the errors that they make are no
white noise: over a window each velocity has a part that swings at frequencies of the band, of unknown phase. These are
shapes of the errors like those of what inputs hide (``identify.unlogged``), and are made white with them: what a model
lacks beside the waves shows, and none of it is taken for them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identify.kernel import HEADING, POSITION, YAW_RATE

if TYPE_CHECKING:
    from identify.stretch import Stretch

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A band reaches so many times its spread to either side, in so many frequencies at most.
REACH, MOST = 2.2, 12


@dataclass(frozen=True)
class Swell:
    """A band of the motion that waves make.

    Attributes
    ----------
    frequency, spread : float
        Middle of the band as the vessel meets it, and its standard deviation, rad/s.
    motion : tuple of float
        Root mean square of u, v, r in it, m/s and rad/s.
    arm : tuple of float
        Of the antenna from the origin, m.
    """

    frequency: float
    spread: float
    motion: tuple[float, float, float]
    arm: tuple[float, float] = (0.0, 0.0)

    def waves(self, t: FloatArray, length: float) -> FloatArray:
        """Independent swings (n, K) at times ``t`` (n,), s, of unit variance in sum, resolved over ``length`` s."""
        count = math.ceil(2.0 * REACH * self.spread * length / math.pi) + 1
        away = np.linspace(-REACH, REACH, min(max(count, 3), MOST))
        size = np.exp(-0.25 * away**2)
        phase = np.outer(t, self.frequency + self.spread * away)
        both = np.concatenate([np.cos(phase) * size, np.sin(phase) * size], axis=1)
        return np.asarray(both / np.sqrt(np.sum(size**2)), dtype=float)


def shown_by(stretch: Stretch, length: float) -> FloatArray:
    """What a stretch's samples show (m, 2, K) of each swing of one standard deviation, in their own units.

    Windows of about ``length`` s are taken to have their own. Nothing where no waves are known.
    """
    t, kind = stretch.samples.t, stretch.samples.kind
    if stretch.swell is None:
        return np.zeros((len(t), 2, 0))
    place, speed, heading, turning = _along(stretch, stretch.swell, length)
    grid = stretch.grid
    i = np.clip(np.searchsorted(grid, t, side="right") - 1, 0, stretch.steps - 1)
    x = ((t - grid[i]) / stretch.h)[:, None, None]
    out = np.zeros((len(t), 2, heading.shape[1]))
    for k in np.unique(kind):
        mine = kind == k
        values = {POSITION: place, HEADING: heading[:, None], YAW_RATE: turning[:, None]}.get(int(k), speed)
        here, there = values[i[mine]], values[i[mine] + 1]
        out[mine, : values.shape[1]] = here + (there - here) * x[mine]
    return out


def _along(
    stretch: Stretch, swell: Swell, length: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """On the grid: position and its rate (n, 2, K) of the antenna, heading and yaw rate (n, K)."""
    waves = swell.waves(stretch.grid - stretch.start, length)
    nothing = np.zeros_like(waves)
    u, v, r = (
        np.concatenate([w * s if k == j else nothing for k in range(3)], axis=1)
        for j, (w, s) in enumerate(zip((waves,) * 3, swell.motion, strict=True))
    )
    psi, ahead, aside = (stretch.states[:, [j]] for j in (2, 3, 4))
    c, s = np.cos(psi), np.sin(psi)
    turned = _summed(r, stretch.h)
    u, v = u - turned * aside, v + turned * ahead
    speed = np.stack([c * u - s * v, s * u + c * v], axis=1)
    x, y = swell.arm
    arm = np.stack([-s * x - c * y, c * x - s * y], axis=1)
    place = _summed(speed, stretch.h) + arm * turned[:, None]
    return place, speed + arm * r[:, None], turned, r


def _summed(rate: FloatArray, h: float) -> FloatArray:
    """Integral of what is given every ``h`` s along the first axis, from nothing."""
    steps = 0.5 * h * (rate[1:] + rate[:-1])
    return np.concatenate([np.zeros((1, *rate.shape[1:])), np.cumsum(steps, axis=0)])
