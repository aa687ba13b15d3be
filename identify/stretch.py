"""One unbroken stretch of a trial, as arrays that the compiled rollout takes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from scipy.ndimage import correlate1d

from identify.actuator_dynamics import Before
from identify.drift import Drift, drifting
from identify.innovations import NO_FILTER, Filter, filter_of, since_used, together
from identify.kernel import HEADING, POSITION, VELOCITY, YAW_RATE
from identify.resample import at_middles, means_of_held
from identify.sensor_line import SensorLine, sensor_line
from identify.slowness import slower
from identify.swell import Swell, path_of
from preprocess.eso_motion import bandwidths_of
from preprocess.gaps import LEAST_SAMPLES, LEAST_SECONDS
from preprocess.trial import Measurement, Trial

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Streams in the order of their kind in the compiled code.
STREAMS = ("position", "heading", "yaw_rate", "velocity")
KIND = {"position": POSITION, "heading": HEADING, "yaw_rate": YAW_RATE, "velocity": VELOCITY}

#: Of an input so many values before a stretch are looked at: no actuator remembers more.
MOST_BEFORE = 10_000

#: Sub-steps per step on which actuators are computed.
SUBSTEPS = 8

#: What a stretch remembers that its samples' σ have no part in.
OF_ANY_WEIGHT = ("remembered", "slopes", "acting", "before")


@dataclass(frozen=True)
class Samples:
    """All sensor samples of a stretch in one set of columns, in the order in which they were taken.

    ``t`` (m,) s as stamped; ``kind`` (m,); ``value`` (m, 2), second column 0 for scalars; ``sigma`` (m,) the sensor's
    noise, of each sample as far as the sensor's own word is followed; ``late`` (4,) how late the stamps of each kind
    are, as far as that is known.
    """

    t: FloatArray
    kind: IntArray
    value: FloatArray
    sigma: FloatArray
    late: FloatArray = field(default_factory=lambda: np.zeros(len(STREAMS)))

    @property
    def taken(self) -> FloatArray:
        """Times (m,) at which they were taken, s."""
        return self.t - self.late[self.kind]

    def taken_within(self, begin: float, end: float, late: FloatArray) -> Samples:
        """Those taken between two times, in their order, by stamps that are ``late`` (4,)."""
        at = self.t - late[self.kind]
        order = np.argsort(at, kind="stable")
        order = order[(at[order] >= begin) & (at[order] <= end)]
        return Samples(self.t[order], self.kind[order], self.value[order], self.sigma[order], late)


@dataclass(frozen=True)
class Stretch:
    """An unbroken stretch on an even grid.

    Attributes
    ----------
    name : str
        The log.
    role : str
        ``identify`` or ``validate``.
    start : float
        Time of the first grid point on the log's clock, s.
    campaign_time : float
        Campaign time of the first grid point, s.
    h : float
        Step, s.
    steps : int
        Number of steps.
    inputs : mapping of str to Measurement
        As logged.
    states : (steps + 1, 6)
        Smoothed x, y, psi, u, v, r (over ground) on the grid.
    sigmas : (steps + 1, 3)
        Standard deviation of the smoothed u, v, r.
    wind : (steps, 2)
        Velocity of the air, north and east; zeros where not logged.
    samples : Samples
        The sensors' good samples within the stretch.
    observed : mapping of str to float
        Bandwidths of the observers that the states come from, rad/s by sensor; none where a smoother made them.
    swell : Swell, optional
        Waves that are known to move the vessel.
    drifts : tuple of Drift
        Of positions and headings, as far as they are known.
    """

    name: str
    role: str
    start: float
    campaign_time: float
    h: float
    steps: int
    inputs: Mapping[str, Measurement]
    states: FloatArray
    sigmas: FloatArray
    wind: FloatArray
    samples: Samples
    observed: Mapping[str, float] = field(default_factory=dict)
    swell: Swell | None = None
    drifts: tuple[Drift, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone: what is remembered can be made again elsewhere."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @property
    def grid(self) -> FloatArray:
        """(steps + 1,) times on the log's clock, s."""
        return self.start + self.h * np.arange(self.steps + 1, dtype=float)

    @cached_property
    def remembered(self) -> Callable[..., Any]:
        """``remembered(make, *key)`` is ``make(stretch, *key)``; the last ones are not made again."""
        return lru_cache(maxsize=2 * max(1, len(self.inputs)))(lambda make, *key: make(self, *key))

    @cached_property
    def slopes(self) -> Callable[[int], FloatArray]:
        """``slopes_of`` the smoothed states over a window; the last ones are remembered."""
        return lru_cache(maxsize=4)(lambda window: slopes_of(self.states, self.h, window))

    @cached_property
    def acting(self) -> Callable[[str, float], tuple[FloatArray, FloatArray]]:
        """What ``sampled`` makes of an input from a time on its log, on the fine grid; the last ones are remembered."""
        step, n = self.h / SUBSTEPS, self.steps * SUBSTEPS
        remembering = lru_cache(maxsize=4 * max(1, len(self.inputs)))
        return remembering(lambda name, begin: sampled(self.inputs[name], begin, step, n))

    @cached_property
    def before(self) -> Callable[[str, float], Before]:
        """What an input was up to a time on its log; the last ones are remembered."""
        remembering = lru_cache(maxsize=4 * max(1, len(self.inputs)))
        return remembering(lambda name, until: before(self.inputs[name], until))

    def known(self, inflation: FloatArray, windows: Sequence[slice]) -> Filter:
        """What takes off the drifts and waves that are known; σ count ``inflation`` (4,) times, a drift with them."""
        if not self.drifts and self.swell is None:
            return NO_FILTER
        t, kind = self.samples.taken, self.samples.kind
        used = np.isin(kind, [d.kind for d in self.drifts]) | (self.swell is not None)
        since = since_used(t, used)
        parts = [d.process(since, kind) for d in drifting(self.drifts, inflation)]
        if self.swell:
            path = path_of(t, since, self.grid, self.states)
            parts.append(self.swell.process(since, kind, path))
        return filter_of(together(parts), self.samples.sigma * inflation[kind], used, windows)

    def weighted(self, sigma: FloatArray, times: FloatArray) -> Stretch:
        """The same with other σ (m,) of its samples, each kind (4,) drifting so many ``times`` as far.

        What these have no part in is remembered on.
        """
        drifts = drifting(self.drifts, times)
        other = replace(self, samples=replace(self.samples, sigma=sigma), drifts=drifts)
        other.__dict__.update({name: getattr(self, name) for name in OF_ANY_WEIGHT})
        return other

    @cached_property
    def gyro_line(self) -> SensorLine:
        """What the gyro said over the smoothed yaw rate: 1, 0 and 0 where the smoother followed it.

        Where a compass told the smoother the turning, the gyro's own scale, bias and clock are here.
        """
        return self._line(YAW_RATE, 5)

    @cached_property
    def compass_line(self) -> SensorLine:
        """The same of what the compass said over the smoothed heading: how late it is where a gyro was followed."""
        return self._line(HEADING, 2)

    def _line(self, kind: int, column: int) -> SensorLine:
        s, mine = self.samples, self.samples.kind == kind
        return sensor_line(s.t[mine], s.value[mine, 0], s.sigma[mine], self.grid, self.states[:, column])


def slopes_of(states: FloatArray, h: float, window: int) -> FloatArray:
    """Rates (n, 3) of u, v, r of states (n + 1, 6) at the middle of each step: slopes over a window each way."""
    m = min(window, max(1, len(states) // 4))
    k = np.arange(-m, m + 1)
    weights = k / (h * np.sum(k * k))
    slope = correlate1d(states[:, 3:6], weights, axis=0, mode="nearest")
    return np.asarray(0.5 * (slope[1:] + slope[:-1]), dtype=float)


def step_for(length: float) -> float:
    """Integration step in s for a vessel of this length: 0.1 s up to 5 m, longer with the root of the length."""
    return 0.1 * slower(length)


def stretches_of(trial: Trial, h: float, least: float = LEAST_SECONDS) -> list[Stretch]:
    """Cut a trial into stretches; those shorter than ``least`` seconds are left out."""
    found = [_stretch(trial, a, b, h) for a, b in trial.segments if b - a >= least]
    return [s for s in found if s is not None]


def _stretch(trial: Trial, begin: float, end: float, h: float) -> Stretch | None:
    states = trial.states
    t = states["t"].to_numpy(dtype=float)
    values = states[["x", "y", "psi", "u", "v", "r"]].to_numpy(dtype=float)
    known = np.isfinite(values).all(axis=1) & (t >= begin) & (t <= end)
    if known.sum() < LEAST_SAMPLES:
        return None
    t, values = t[known], values[known]
    steps = int((t[-1] - t[0]) / h)
    grid = t[0] + h * np.arange(steps + 1)
    sigma = states[["sigma_u", "sigma_v", "sigma_r"]].to_numpy(dtype=float)[known]
    sigmas = np.column_stack([np.interp(grid, t, column) for column in np.nan_to_num(sigma).T])
    on_grid = np.column_stack([np.interp(grid, t, column) for column in values.T])
    return Stretch(
        trial.name, trial.role, float(t[0]), trial.start + float(t[0]), h, steps, trial.inputs, on_grid,
        sigmas, _wind(trial, grid), _samples(trial, grid[0], grid[-1]), bandwidths_of(trial.history),
        drifts=_drifts(trial),
    )  # fmt: skip


def _drifts(trial: Trial) -> tuple[Drift, ...]:
    known = {k: m for k, m in trial.measurements.items() if k in STREAMS and m.wander > 0.0}
    return tuple(Drift(m.wander, m.correlation_time, KIND[k], m.smooth) for k, m in known.items())


def _wind(trial: Trial, grid: FloatArray) -> FloatArray:
    wind = trial.measurements.get("wind")
    if wind is None or not wind.good.any():
        return np.zeros((len(grid) - 1, 2))
    middle = 0.5 * (grid[1:] + grid[:-1])
    good = wind.good
    return np.column_stack([np.interp(middle, wind.t[good], wind.value[good, k]) for k in range(2)])


def _samples(trial: Trial, begin: float, end: float) -> Samples:
    parts = [
        _of_stream(trial.measurements[s], KIND[s], begin, end) for s in STREAMS if s in trial.measurements
    ]
    columns = [np.concatenate(c) for c in zip(*parts, strict=True)]
    order = np.argsort(columns[0], kind="stable")
    t, kind, value, sigma = (c[order] for c in columns)
    return Samples(t, kind.astype(np.int64), value, sigma)


def _of_stream(
    m: Measurement, kind: int, begin: float, end: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    keep = m.good & (m.t >= begin) & (m.t <= end)
    value = np.zeros((int(keep.sum()), 2))
    value[:, : 2 if m.value.ndim == 2 else 1] = m.value[keep].reshape(len(value), -1)
    keep_finite = np.isfinite(value).all(axis=1)
    value = value[keep_finite]
    n = len(value)
    sigma = np.full(n, max(m.sigma, 1e-9))
    if m.weight is not None:
        sigma *= np.sqrt(m.weight[keep][keep_finite])
    return m.t[keep][keep_finite], np.full(n, float(kind)), value, sigma


def before(m: Measurement, until: float) -> Before:
    """What an input was up to a time on its log, the last ``MOST_BEFORE`` of its values."""
    known = m.good & (m.t <= until)
    t, told = m.t[known], np.asarray(m.value[known], dtype=float)
    changed = np.diff(told, prepend=np.nan) != 0.0
    t, told = t[changed][-MOST_BEFORE:], told[changed][-MOST_BEFORE:]
    return Before(told, np.diff(t, append=until))


def sampled(m: Measurement, begin: float, step: float, n: int) -> tuple[FloatArray, FloatArray]:
    """Mean (n,) of an input over each ``step`` from ``begin``: values that hold, or straight lines between them.

    The second (n,) is what a quadratic thrust has more than that of the mean, where a held input switches in a step.
    """
    t, value = m.t[m.good], m.value[m.good]
    if not math.isfinite(begin):
        return np.full(n, np.nan), np.full(n, np.nan)
    if len(t) == 0:
        return np.zeros(n), np.zeros(n)
    if m.held:
        mean, more = means_of_held(t, value, begin, step, n)
        return mean, more
    return at_middles(t, value, begin, step, n), np.zeros(n)
