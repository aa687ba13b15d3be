"""Waves that are known to be there, as what they leave open in every window's predictions.

Waves move a vessel whatever it does; no model can say when. Once their band is known, the errors that they make are no
white noise: over a window each velocity has a part that swings at frequencies of the band, of unknown phase. These are
shapes of the errors like those of what inputs hide (``identify.unlogged``), and are made white with them: what a model
lacks beside the waves shows, and none of it is taken for them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from identify.kernel import HEADING, POSITION, YAW_RATE

if TYPE_CHECKING:
    from identify.stretch import Stretch

ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]
FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Half width at half height of a resonance whose band has a unit of spread.
RESONANCE = 0.6
#: Beyond so many of these widths a band is its skirt, which ends at these multiples of its frequency.
CORE, ENDS = 3.0, (0.4, 3.5)
#: Frequencies are so many cycles of a window apart; the skirt has so many at most.
APART, MOST = 0.75, 44
#: A window's variance is reckoned at so many times.
STEPS = 200


@dataclass(frozen=True)
class Sighting:
    """How waves were seen.

    Attributes
    ----------
    frequency, frequency_stderr : float
        Middle of the band of the accelerations that the waves make, rad/s, and its standard error: of what varies from
        window to window, or of what varies from log to log where that is more.
    sharpness : float
        What varies from window to window of it alone.
    amplitudes, stderrs : mapping of str to float
        Per channel u, v, r: √2 times the root mean square of the acceleration, m/s² or rad/s².
    p_value : float
        Probability of such a peak at any frequency looked at, in any channel, by chance.
    share : mapping of str to float
        Per channel: part of the mean squared error of u, v, r over windows (prediction less smoothed measurement)
        that lies in the peak.
    together : ndarray
        Coherence (3, 3) of u, v, r in the band, complex.
    """

    frequency: float
    frequency_stderr: float
    sharpness: float
    amplitudes: Mapping[str, float]
    stderrs: Mapping[str, float]
    p_value: float
    share: Mapping[str, float]
    together: ComplexArray = field(compare=False)


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
    damping : tuple of float
        How fast u, v, r forget a push, 1/s.
    seen : Sighting, optional
        How they were seen.
    skirt : float
        Power far from the middle, over what a resonance that white noise drives has there.
    """

    frequency: float
    spread: float
    motion: tuple[float, float, float]
    arm: tuple[float, float] = (0.0, 0.0)
    damping: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seen: Sighting | None = None
    skirt: float = 0.0

    @property
    def width(self) -> float:
        """Half width of the band at half its height, as that of a resonance, rad/s."""
        return RESONANCE * self.spread

    def waves(self, t: FloatArray, length: float) -> FloatArray:
        """Independent swings (n, K) at times ``t`` (n,), s, resolved over ``length`` s; the core's variance is 1."""
        apart, core = 2.0 * math.pi * APART / length, CORE * self.width
        low, high = (round(abs(e - 1.0) * self.frequency / apart) for e in ENDS)
        low = min(low, MOST // 2)
        some = (low, min(high, MOST - low)) if self.skirt > 0.0 else (0, 0)
        least = max(2, math.ceil(core / apart))
        away = apart * np.arange(-max(some[0], least), max(some[1], least) + 1)
        power = 1.0 / (1.0 + (away / self.width) ** 2)
        near = np.abs(away) <= core
        size = np.sqrt(power * np.where(near, 1.0, self.skirt) / power[near].sum())
        phase = np.outer(t, self.frequency + away)
        return np.concatenate([np.cos(phase) * size, np.sin(phase) * size], axis=1)

    def pushed(self, t: FloatArray, axis: int, length: float) -> FloatArray:
        """Velocity (n, K) along an axis at times ``t`` (n,) that the skirt's slow pushes leave, if it has any.

        One column for each block of any ``length`` s: what came before a window is in its first state.
        """
        push = math.sqrt(4.0 * self.width * self.skirt) * self.motion[axis]
        if not push > 0.0:
            return np.zeros((len(t), 0))
        block = math.pi / (ENDS[0] * self.frequency)
        count = math.ceil(length / block) + 1
        begin = np.arange(t[0] + 0.5 * block, max(t[-1], t[0] + block), block)
        since = t[:, None] - begin
        left = (since > 0.0) * np.exp(-max(self.damping[axis], 0.0) * np.maximum(since, 0.0))
        blocks = [left[:, k::count].sum(axis=1) for k in range(min(count, len(begin)))]
        return push * math.sqrt(block) * np.column_stack(blocks)

    def along(self, t: FloatArray, axis: int, length: float) -> FloatArray:
        """All that is left open of a velocity along an axis (n, K) at times ``t`` (n,), s."""
        return np.concatenate(
            [self.waves(t, length) * self.motion[axis], self.pushed(t, axis, length)], axis=1
        )

    def variance(self, length: float) -> FloatArray:
        """Of u, v, r (3,) about their mean over ``length`` s."""
        t = np.linspace(0.0, length, STEPS)
        return np.array([self.along(t, k, length).var(axis=0).sum() for k in range(3)])


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
    t = stretch.grid - stretch.start
    waves = swell.waves(t, length)
    each = [
        np.concatenate([waves * s, swell.pushed(t, k, length)], axis=1) for k, s in enumerate(swell.motion)
    ]
    u, v, r = (
        np.concatenate([x if k == j else np.zeros_like(x) for k, x in enumerate(each)], axis=1)
        for j in range(3)
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
