"""Windows over stretches: prediction errors of the raw measurements and their moments, many windows at once."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import expm

from identify import kernel
from identify.drive import Directions, Drive, directions, drive
from identify.regression import through_water
from identify.stretch import SUBSTEPS, IntArray, Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Weak knowledge of a window's first state beside its own measurements, 1σ: x, y, psi, u, v, r, e1, e2.
STATE_PRIOR = np.array([20.0, 20.0, 1.0, 3.0, 3.0, 1.0, 0.5, 0.5])

#: An effect's own states follow from the smoothed motion; they are not free.
_FOLLOWS = 1e-5


@dataclass(frozen=True)
class Window:
    """Part of a stretch that is predicted from a first state of its own: steps [first, first + steps)."""

    stretch: int
    first: int
    steps: int
    samples: slice


@dataclass(frozen=True)
class Problem:
    """Stretches cut into windows, and how much larger than the sensors' own noise each stream's errors count.

    ``inflation`` (4,) multiplies the σ of position, heading, yaw rate and velocity; ``dispersion`` (4,) is how much
    more than white noise the errors of a stream count in slow averages (for tests and intervals); ``length`` is the
    length of a window that was asked for, s.
    """

    stretches: tuple[Stretch, ...]
    windows: tuple[Window, ...]
    inflation: FloatArray
    dispersion: FloatArray
    length: float
    workers: int = 2

    @cached_property
    def rows(self) -> int:
        """Number of scalar measurements."""
        total = 0
        for w in self.windows:
            kind = self.stretches[w.stretch].samples.kind[w.samples]
            total += len(kind) + int(np.sum((kind == kernel.POSITION) | (kind == kernel.VELOCITY)))
        return total

    def weighted_as(self, other: Problem) -> Problem:
        """The same windows with the weights of another problem."""
        return replace(self, inflation=other.inflation, dispersion=other.dispersion)

    @property
    def dispersed(self) -> Problem:
        """The same with errors weighted by what they have at low frequency."""
        return replace(self, inflation=self.inflation * self.dispersion)


@dataclass(frozen=True)
class Moments:
    """Per window: moment matrix (8 + np + 1 square: first state, parameters, error) and normalised errors."""

    matrices: FloatArray
    residuals: tuple[FloatArray, ...]

    @property
    def cost(self) -> float:
        """Sum of squared normalised errors; NaN where a prediction ran away."""
        return float(self.matrices[:, -1, -1].sum())


def cut(stretches: Sequence[Stretch], length: float, workers: int = 2) -> Problem:
    """Cut stretches into windows of about ``length`` seconds."""
    windows = [w for k, s in enumerate(stretches) for w in _cut(k, s, length)]
    return Problem(tuple(stretches), tuple(windows), np.ones(4), np.ones(4), length, workers)


def _cut(index: int, stretch: Stretch, length: float) -> list[Window]:
    count = max(1, round(stretch.steps * stretch.h / length))
    edges = np.linspace(0, stretch.steps, count + 1).astype(int)
    times = stretch.start + stretch.h * edges
    times[0] -= 1e-9
    places = np.searchsorted(stretch.samples.t, times, side="right")
    places[-1] = len(stretch.samples.t)
    return [
        Window(index, int(a), int(b - a), slice(int(i), int(j)))
        for a, b, i, j in zip(edges[:-1], edges[1:], places[:-1], places[1:], strict=True)
        if b - a > 2 and j - i > 10
    ]


def first_states(problem: Problem, current: FloatArray | None = None) -> FloatArray:
    """First state (windows, 8) of every window from the smoothed states, velocities through the water."""
    out = np.zeros((len(problem.windows), kernel.NX))
    for k, w in enumerate(problem.windows):
        state = problem.stretches[w.stretch].states[w.first : w.first + 1]
        out[k, :6] = state[0] if current is None else through_water(state, current)[0]
    return out


def state_precision(structure: Structure) -> FloatArray:
    """Precision (8,) with which a window's first state is known beforehand."""
    sd = STATE_PRIOR.copy()
    if structure.has_following_states:
        sd[6:] = _FOLLOWS
    return np.asarray(1.0 / sd**2, dtype=float)


def following_states(structure: Structure, d: Drive, stretch: Stretch) -> FloatArray:
    """States (steps + 1, 2) of an effect's own oscillator, driven by the smoothed motion from rest."""
    own = {(t.dof, t.text): c for t, c in zip(structure.table.terms, d.coefficients, strict=True)}
    a = np.array([[0.0, 1.0], [own[("e2", "e1")], own[("e2", "e2")]]])
    block = np.zeros((3, 3))
    block[:2, :2], block[1, 2] = a, 1.0
    step = expm(block * stretch.h)
    force = through_water(stretch.states, d.current)[:, 3] * stretch.states[:, 5]
    found = kernel.oscillator(np.ascontiguousarray(step), 0.5 * (force[1:] + force[:-1]))
    return np.asarray(found, dtype=float)


def moments(problem: Problem, structure: Structure, p: FloatArray, first: FloatArray) -> Moments:
    """Predict every window and form its moments with respect to its first state and all parameters."""
    prepared = [(drive(structure, p, s), directions(structure, p, s)) for s in problem.stretches]
    if structure.has_following_states:
        follow = [
            following_states(structure, d, s) for (d, _), s in zip(prepared, problem.stretches, strict=True)
        ]
        first = first.copy()
        first[:, 6:] = [follow[w.stretch][w.first] for w in problem.windows]

    def one(k: int) -> tuple[FloatArray, FloatArray]:
        w = problem.windows[k]
        return _window(problem, structure, w, first[k], *prepared[w.stretch])

    with ThreadPoolExecutor(problem.workers) as pool:
        results = list(pool.map(one, range(len(problem.windows))))
    return Moments(np.array([m for m, _ in results]), tuple(r for _, r in results))


def _window(
    problem: Problem, structure: Structure, w: Window, first: FloatArray, d: Drive, along: Directions
) -> tuple[FloatArray, FloatArray]:
    table, stretch = structure.table, problem.stretches[w.stretch]
    part = slice(w.first, w.first + w.steps)
    simple = np.array([structure.slots[k].coefficient for k in structure.simple], dtype=np.int64)
    nd = kernel.NX + len(simple) + len(structure.general)
    states, rates = np.empty((w.steps + 1, kernel.NX)), np.empty((w.steps + 1, kernel.NX))
    s_all, f_all = np.empty((w.steps + 1, kernel.NX, nd)), np.empty((w.steps + 1, kernel.NX, nd))
    by_all = np.empty((w.steps, 3, d.channels.shape[1]))
    done = kernel.sensitivities(
        first, stretch.h, structure.model.discrete, d.channels[part], d.slopes[part], d.wind[part], d.current,
        structure.u0, table.equation, table.which, table.product, d.coefficients, simple, table.equation_of,
        along.coefficients, along.channels[part], along.slopes[part], along.current, states, rates, s_all, f_all,
        by_all,
    )  # fmt: skip
    moment = np.zeros((nd + 1, nd + 1))
    residual = np.zeros((w.samples.stop - w.samples.start, 2))
    if done < w.steps:
        moment[-1, -1] = np.nan
        return moment, residual
    step, fraction, kind, observed, weight = _rows(problem, w, d.sensor)
    sensor = np.zeros((kernel.NM, nd))
    sensor[:, kernel.NX + len(simple) :] = along.sensor
    kernel.normal_equations(
        stretch.h, states, rates, s_all, f_all, by_all, step, fraction, kind, observed, weight,
        _within(d, w, stretch.h, step, fraction),         d.sensor, sensor, sensor.any(axis=1), moment, residual,
    )  # fmt: skip
    return _ordered(structure, moment, d.factor[simple]), residual


def _rows(
    problem: Problem, w: Window, sensor: FloatArray
) -> tuple[IntArray, FloatArray, IntArray, FloatArray, FloatArray]:
    """Place of every sample of a window on its grid, each stream's clock offset taken off."""
    stretch, samples = problem.stretches[w.stretch], problem.stretches[w.stretch].samples
    kind = samples.kind[w.samples]
    t = samples.t[w.samples] - sensor[5:9][kind] - (stretch.start + stretch.h * w.first)
    place = t / stretch.h
    step = np.clip(np.floor(place).astype(np.int64), 0, w.steps - 1)
    weight = 1.0 / (samples.sigma[w.samples] * problem.inflation[kind])
    return step, place - step, kind, samples.value[w.samples], weight


def _within(d: Drive, w: Window, h: float, step: IntArray, fraction: FloatArray) -> FloatArray:
    """Integral of each channel (m, nc) from its step's begin to the sample, less that of the step's straight line."""
    nc = d.channels.shape[1]
    parts = d.fine.reshape(-1, SUBSTEPS, nc)[w.first + step]
    x = np.clip(fraction, 0.0, 1.0)[:, None]
    covered = np.clip(x * SUBSTEPS - np.arange(SUBSTEPS), 0.0, 1.0) / SUBSTEPS
    line = d.channels[w.first + step] * x + d.slopes[w.first + step] * (x * x - x)
    return np.asarray(h * (np.einsum("ms,msc->mc", covered, parts) - line), dtype=float)


def _ordered(structure: Structure, moment: FloatArray, factor: FloatArray) -> FloatArray:
    """Full symmetric moment matrix, parameters in the order of the slots, loading's factor on their columns."""
    scale = np.ones(len(moment))
    scale[kernel.NX : kernel.NX + len(factor)] = factor
    full = (moment + np.triu(moment, 1).T) * scale * scale[:, None]
    order = np.concatenate([structure.simple, structure.general]).argsort()
    columns = np.concatenate([np.arange(kernel.NX), kernel.NX + order, [len(full) - 1]])
    return np.asarray(full[np.ix_(columns, columns)], dtype=float)
