"""Waves that are known to be there, as what they leave open in every window's predictions.

Waves move a vessel whatever it does; no model can say when. Once their band is known, the errors that they make are no
white noise: each velocity has a part that swings in the band, as a resonance does that white noise drives (Fossen 2021,
sec. 10.2), and pushes that last leave a slow part beside it. Both are states of the filter that makes the errors white
(``identify.innovations``): what a model lacks beside the waves shows, and none of it is taken for them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov

from identify.innovations import Process
from identify.kernel import HEADING, POSITION, VELOCITY, YAW_RATE

ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]
FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
_Table = dict[tuple[int, int], FloatArray]

#: Half width at half height of a resonance, that white noise drives, whose band has a unit of spread.
RESONANCE = 0.6
#: No band's resonances are damped by more than this share of their frequency.
WIDEST = 0.5
#: A window's variance is reckoned at so many times.
STEPS = 200
#: A damping below this is none, 1/s.
TINY = 1e-9
#: Times are looked up at so many s from each other.
APART = 1e-3
#: States: of the band along u, v, r four each (displacement and velocity of a resonance that white noise drives, and of
#: one that the first one's velocity drives: these are the vessel's); velocities that pushes leave; heading beside the
#: band's own; place, north and east, beside that of the band's displacements.
BANDS, PUSHED, HEADING_LEFT, PLACE = (0, 4, 8), (12, 13, 14), 15, (16, 17)
COUNT = 18
#: Which of a band's states say anything of which, and pairs of them.
COUPLED = tuple((i, j) for i in range(4) for j in range(4) if i >= 2 or j < 2)
UPPER = tuple((i, j) for i in range(4) for j in range(i, 4))


@dataclass(frozen=True)
class Sighting:
    """How waves were seen.

    Attributes
    ----------
    frequency, frequency_stderr : float
        Of the resonance that the accelerations which the waves make look like, rad/s, and its standard error: of what
        varies from window to window, or from log to log where that is more, and how far their centroid is from it.
    sharpness : float
        What varies from window to window of the centroid alone.
    amplitudes, stderrs : mapping of str to float
        Per channel u, v, r: √2 times the root mean square of the acceleration, m/s² or rad/s².
    p_value : float
        Probability of such a peak at any frequency looked at, in any channel, by chance.
    share : mapping of str to float
        Per channel: part of the mean squared error of u, v, r over windows (prediction less smoothed measurement)
        that lies in the peak.
    together : ndarray
        Coherence (3, 3) of u, v, r in the band, complex.
    cycles : float
        Of the waves, in a window that they were seen in.
    """

    frequency: float
    frequency_stderr: float
    sharpness: float
    amplitudes: Mapping[str, float]
    stderrs: Mapping[str, float]
    p_value: float
    share: Mapping[str, float]
    together: ComplexArray = field(compare=False)
    cycles: float = math.inf


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
    def pushes(self) -> FloatArray:
        """What the skirt pushes u, v, r with slowly (3,): white intensity times √s."""
        width = RESONANCE * self.spread
        return np.asarray(np.sqrt(4.0 * width * self.skirt) * np.array(self.motion), dtype=float)

    def variance(self, length: float) -> FloatArray:
        """Of u, v, r (3,) over ``length`` s."""
        own = np.array(self.motion) ** 2
        t = np.linspace(0.0, length, STEPS)
        slow = self.pushes**2 * np.array([_grown(max(d, 0.0), t).mean() for d in self.damping])
        return np.asarray(own + slow, dtype=float)

    def process(self, since: FloatArray, kind: IntArray, path: Path) -> Process:
        """Its states at samples (m,) of these kinds, each so long ``since`` the one before, s, along a ``path``."""
        carried: _Table = {}
        noise: _Table = {}
        begin = np.zeros((COUNT, COUNT))
        band = _band(self.frequency, min(self.spread, WIDEST * self.frequency), since)
        for k, motion in enumerate(self.motion):
            at = BANDS[k]
            carried |= {(at + i, at + j): band.carried[:, i, j] for i, j in COUPLED}
            noise |= {(at + i, at + j): motion**2 * band.noise[:, i, j] for i, j in UPPER}
            begin[at : at + 4, at : at + 4] = motion**2 * band.begin
            self._push(since, k, carried, noise)
        self._turn(since, path, band.gone, carried)
        places, by = _listed(carried, len(since))
        noise_places, variance = _listed(noise, len(since))
        return Process(places, by, noise_places, variance, self._seen(kind, path), begin)

    def _push(self, since: FloatArray, k: int, carried: _Table, noise: _Table) -> None:
        """A velocity that slow pushes leave, forgotten as the vessel's damping says."""
        damping, at = max(self.damping[k], 0.0), PUSHED[k]
        carried[at, at] = np.exp(-damping * since)
        noise[at, at] = self.pushes[k] ** 2 * _grown(damping, since)

    def _turn(self, since: FloatArray, path: Path, gone: FloatArray, carried: _Table) -> None:
        """Heading beside the band's own, and place beside that of its displacements, along a path.

        ``gone`` (m, 4): what a displacement adds up to since, by the band's states before.
        """
        c, s, r = np.cos(path.psi_before), np.sin(path.psi_before), path.turning
        slow = [_lasted(max(d, 0.0), since) for d in self.damping]
        one = np.ones(len(since))
        carried |= {(HEADING_LEFT, HEADING_LEFT): one, (HEADING_LEFT, PUSHED[2]): slow[2]}
        ways = ((PLACE[0], -path.east, (s, c), (c, -s)), (PLACE[1], path.north, (-c, s), (s, c)))
        for at, aside, swung, pushed in ways:
            carried |= {(at, at): one, (at, HEADING_LEFT): aside * since}
            for by, band in ((r * swung[0], BANDS[0]), (r * swung[1], BANDS[1]), (aside, BANDS[2])):
                carried |= {(at, band + j): by * gone[:, j] for j in range(4)}
            carried |= {(at, PUSHED[k]): pushed[k] * slow[k] for k in range(2)}

    def _seen(self, kind: IntArray, path: Path) -> FloatArray:
        """What of the states the rows of samples show (m, 2, D)."""
        seen = np.zeros((len(kind), 2, COUNT))
        c, s, (x, y) = np.cos(path.psi), np.sin(path.psi), self.arm
        arm = (-s * x - c * y, c * x - s * y)
        heading, turning = [BANDS[2] + 2, HEADING_LEFT], [BANDS[2] + 3, PUSHED[2]]
        placed, moving, turned = kind == POSITION, kind == VELOCITY, kind == HEADING
        for axis, (ahead, aside) in enumerate(((c, -s), (s, c))):
            rate = path.north_now if axis else -path.east_now
            seen[placed, axis, PLACE[axis]] = 1.0
            for k, by in enumerate((ahead, aside)):
                seen[placed, axis, BANDS[k] + 2] = by[placed]
                seen[moving, axis, BANDS[k] + 3] = seen[moving, axis, PUSHED[k]] = by[moving]
            for part, by in ((placed, arm[axis]), (moving, rate)):
                seen[np.ix_(part, [axis], heading)] = by[part][:, None, None]
            seen[np.ix_(moving, [axis], turning)] = arm[axis][moving][:, None, None]
        seen[np.ix_(turned, [0], heading)] = 1.0
        seen[np.ix_(kind == YAW_RATE, [0], turning)] = 1.0
        return seen


@dataclass(frozen=True)
class Path:
    """Where a vessel heads and how it moves as the samples (m,) are taken, and in the middle of the time before each.

    ``psi``, rad, ``north_now`` and ``east_now``, m/s, at the samples; ``psi_before``, ``turning``, rad/s, ``north`` and
    ``east`` in the middle of the time before.
    """

    psi: FloatArray
    north_now: FloatArray
    east_now: FloatArray
    psi_before: FloatArray
    turning: FloatArray
    north: FloatArray
    east: FloatArray


def path_of(t: FloatArray, since: FloatArray, grid: FloatArray, states: FloatArray) -> Path:
    """The path of smoothed ``states`` (n + 1, 6) on a grid, at samples (m,) so long ``since`` the one before."""
    psi, u, v, r = states[:, 2], states[:, 3], states[:, 4], states[:, 5]
    north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    now = (np.interp(t, grid, x) for x in (psi, north, east))
    before = (np.interp(t - 0.5 * since, grid, x) for x in (psi, r, north, east))
    return Path(*now, *before)


class _Band(NamedTuple):
    """A band of unit variance along one axis: what its states become, what noise adds to their covariance (m, 4, 4).

    ``gone`` (m, 4): what the displacement adds up to; ``begin`` (4, 4): the covariance that they always have.
    """

    carried: FloatArray
    noise: FloatArray
    gone: FloatArray
    begin: FloatArray


def _band(frequency: float, damping: float, since: FloatArray) -> _Band:
    """Two resonances of this frequency and damping, rad/s and 1/s, the second driven by the first one's velocity."""
    w2, d2 = frequency**2, 2.0 * damping
    rates = np.array([[0.0, 1.0, 0.0, 0.0], [-w2, -d2, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, d2, -w2, -d2]])
    always = solve_continuous_lyapunov(rates, -np.diag([0.0, 1.0, 0.0, 0.0]))
    always /= always[3, 3]
    step, steps = expm(rates * APART), [np.eye(4)]
    place = np.rint(since / APART).astype(int)
    for _ in range(int(place.max(initial=0))):
        steps.append(steps[-1] @ step)
    rest = (since - APART * place)[:, None, None]
    near = np.eye(4) + rest * rates + 0.5 * rest**2 * (rates @ rates)
    carried = np.array(steps)[place] @ near
    noise = always - carried @ always @ np.swapaxes(carried, 1, 2)
    gone = np.linalg.solve(rates.T, np.eye(4)[2]) @ (carried - np.eye(4))
    return _Band(carried, noise, gone, always)


def _grown(damping: float, t: FloatArray) -> FloatArray:
    """Variance of a velocity that white pushes of unit intensity drive, so long after it was nothing."""
    return np.asarray(-np.expm1(-2.0 * damping * t) / (2.0 * damping) if damping > TINY else t, dtype=float)


def _lasted(damping: float, t: FloatArray) -> FloatArray:
    """How far a velocity of one goes in so long a time."""
    return np.asarray(-np.expm1(-damping * t) / damping if damping > TINY else t, dtype=float)


def _listed(table: _Table, count: int) -> tuple[IntArray, FloatArray]:
    """Places (k, 2) and values (m, k) of a table."""
    return np.array(list(table), dtype=np.int64), np.column_stack(
        [np.broadcast_to(x, count) for x in table.values()]
    )
