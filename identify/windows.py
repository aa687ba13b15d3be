"""Windows over stretches: prediction errors of the raw measurements and their moments, many windows at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from identify import kernel
from identify.compiled import along_all, motion_of, no_sensors, nothing_along, places_of, rows_of, sensing_of
from identify.disturbed import Sizes
from identify.drive import Drive, drives
from identify.first_states import begun
from identify.innovations import Filter, new_in
from identify.measure import moments_of_windows
from identify.moments import Moments
from identify.sample import nothing_white, work_for
from identify.stretch import IntArray, Stretch
from identify.structure import Structure
from identify.swell import Swell
from identify.tangents import Along, padded, run_for
from identify.threads import abreast
from identify.unlogged import Unlogged
from identify.whitening import Part, Whitening, whitening_of
from preprocess.cores import granted

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: Windows are shared among threads from so many steps times columns on: to hand over less costs more than it saves.
WORTH_SHARING = 150_000
#: What the inputs did before a log nobody knows, and a lag or a delay remembers it: at most so many first steps of a
#: log, and this share of it, are predicted by no window.
BEFORE, SHARE_BEFORE = 30, 0.05


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
    length of a window that was asked for, s; ``unlogged`` is what the logged inputs hide.
    """

    stretches: tuple[Stretch, ...]
    windows: tuple[Window, ...]
    inflation: FloatArray
    dispersion: FloatArray
    length: float
    unlogged: Unlogged | None = None

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone: what is remembered can be made again elsewhere."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @cached_property
    def whitening(self) -> Whitening | None:
        """What the errors of every window are whitened by; None where nothing is hidden."""
        return None if self.hidden is None else whitening_of(self, self.hidden)

    @cached_property
    def hidden(self) -> tuple[Part, ...] | None:
        """What the inputs' logs do not say."""
        return self.unlogged.over(self).parts if self.unlogged else None

    @property
    def swell(self) -> Swell | None:
        """Waves that are known to move the vessel."""
        return next((s.swell for s in self.stretches if s.swell), None)

    @cached_property
    def known(self) -> tuple[Filter, ...]:
        """How a drift of the positions, and waves, are taken off in every stretch, where any are known."""
        mine: list[list[slice]] = [[] for _ in self.stretches]
        for w in self.windows:
            mine[w.stretch].append(w.samples)
        return tuple(s.known(self.inflation, own) for s, own in zip(self.stretches, mine, strict=True))

    def less_known(self, window: Window, columns: FloatArray) -> FloatArray:
        """Errors (m, 2) of a window, or columns (m, 2, k), in units of their weight, less a drift and waves."""
        shape = columns.shape
        columns = columns.reshape(*shape[:2], math.prod(shape[2:]))
        return new_in(self.known[window.stretch], window.samples, columns).reshape(shape)

    @property
    def hides(self) -> bool:
        """Whether anything moves the vessel that no log says."""
        return self.unlogged is not None or self.swell is not None

    @property
    def pushes(self) -> Sizes | None:
        """Pushes and drifts that are known though no log says them."""
        return self.unlogged.pushes if self.unlogged else None

    @property
    def drifts(self) -> bool:
        """Whether a drift of the positions is known."""
        return any(d.kind == kernel.POSITION for s in self.stretches for d in s.drifts)

    @cached_property
    def rows(self) -> int:
        """Number of scalar measurements."""
        total = 0
        for w in self.windows:
            two = self.two_axes(w)
            total += len(two) + int(np.sum(two))
        return total

    @cached_property
    def inflated(self) -> float:
        """Mean square of what errors are weighed by, in units of their white noise."""
        kinds = np.concatenate([self.kinds(w) for w in self.windows])
        return float(np.mean(self.inflation[kinds] ** 2))

    def white(self, number: int, error: FloatArray) -> FloatArray:
        """A window's errors (m, 2), white as far as it is said what drifts and what the inputs hide."""
        w = self.windows[number]
        error = self.less_known(w, error)
        return (
            error if self.whitening is None else self.whitening.whitened(number, w.stretch, w.samples, error)
        )

    def kinds(self, window: Window) -> IntArray:
        """Kind (m,) of every sample of a window."""
        return self.stretches[window.stretch].samples.kind[window.samples]

    def two_axes(self, window: Window) -> BoolArray:
        """Which samples (m,) of a window are two measurements, north and east."""
        kind = self.kinds(window)
        return np.asarray((kind == kernel.POSITION) | (kind == kernel.VELOCITY), dtype=bool)

    def weighted_as(self, other: Problem) -> Problem:
        """The same windows with the weights of another problem."""
        return replace(self, inflation=other.inflation, dispersion=other.dispersion, unlogged=other.unlogged)

    @property
    def dispersed(self) -> Problem:
        """The same with errors weighted by what they have at low frequency."""
        return replace(self, inflation=self.inflation * self.dispersion)


def cut(stretches: Sequence[Stretch], length: float) -> Problem:
    """Cut stretches into windows of about ``length`` seconds."""
    windows = [w for k, s in enumerate(stretches) for w in _cut(k, s, length)]
    return Problem(tuple(stretches), tuple(windows), np.ones(4), np.ones(4), length)


def _cut(index: int, stretch: Stretch, length: float) -> list[Window]:
    begin = _remembering(stretch)
    count = max(1, round((stretch.steps - begin) * stretch.h / length))
    edges = np.linspace(begin, stretch.steps, count + 1).astype(int)
    times = stretch.start + stretch.h * edges
    times[0] -= 1e-9
    places = np.searchsorted(stretch.samples.taken, times, side="right")
    places[-1] = len(stretch.samples.t)
    return [
        Window(index, int(a), int(b - a), slice(int(i), int(j)))
        for a, b, i, j in zip(edges[:-1], edges[1:], places[:-1], places[1:], strict=True)
        if b - a > 2 and j - i > 10
    ]


def _remembering(stretch: Stretch) -> int:
    """Steps at a log's begin in which an actuator that is late may still answer to what came before it."""
    first = min((float(m.t[0]) for m in stretch.inputs.values() if len(m.t)), default=stretch.start)
    known = round(max(0.0, stretch.start - first) / stretch.h)
    return max(0, min(BEFORE, round(SHARE_BEFORE * stretch.steps)) - known)


def moments(
    problem: Problem,
    structure: Structure,
    p: FloatArray,
    first: FloatArray,
    *,
    held: bool = False,
    added: Sequence[FloatArray] | None = None,
) -> Moments:
    """Predict every window and form its moments with respect to its first state and all parameters.

    With these ``held``, with respect to the first state alone: np is then 0. ``added`` (m, 2) to every window's errors,
    in units of their weight, is what they are to be beside what they are.
    """
    driven = drives(structure, p, problem.stretches)
    first, unit = begun(problem, structure, driven, first)
    along = _nothing(len(driven)) if held else along_all(structure, p, problem.stretches, driven)
    columns = kernel.NX + (0 if held else len(structure.slots)) + 1
    hidden, _ = problem.whitening, problem.known  # made before the threads ask for them
    beside = None if added is None else _by_stretch(problem, added)
    size = columns * sum(s.steps for s in problem.stretches)
    workers = granted() if size >= WORTH_SHARING else 1
    shares = [
        (driven[k], along[k], np.array(part))
        for k in range(len(driven))
        for part in _shares(problem, k, workers)
    ]
    done = abreast(
        lambda share: _of_windows(problem, structure, hidden, first, columns, beside, *share), shares, workers
    )
    matrices = np.empty((len(problem.windows), *done[0][0].shape[1:]))
    raw: list[FloatArray] = [np.zeros(0)] * len(problem.windows)
    for (_, _, numbers), (found, errors) in zip(shares, done, strict=True):
        found[:, : kernel.NX] *= unit[:, None]
        found[:, :, : kernel.NX] *= unit
        matrices[numbers] = found
        for k in numbers:
            raw[k] = errors[problem.windows[k].samples]
    return Moments(matrices, tuple(raw), problem.white)


def _shares(problem: Problem, stretch: int, workers: int) -> list[list[int]]:
    """The windows of a stretch, shared among the workers."""
    mine = [k for k, w in enumerate(problem.windows) if w.stretch == stretch]
    size = max(1, -(-len(mine) // workers))
    return [mine[k : k + size] for k in range(0, len(mine), size)]


def _by_stretch(problem: Problem, errors: Sequence[FloatArray]) -> list[FloatArray]:
    """Errors (m, 2) of every window in the rows of their stretches' samples."""
    every: list[FloatArray] = [np.zeros((len(s.samples.t), 2)) for s in problem.stretches]
    for w, e in zip(problem.windows, errors, strict=True):
        every[w.stretch][w.samples] = e
    return every


def _nothing(stretches: int) -> list[tuple[Along, FloatArray]]:
    """The directions of so many stretches where no parameter moves."""
    return [(nothing_along(kernel.NX + 1), no_sensors(kernel.NX + 1))] * stretches


def _of_windows(
    problem: Problem,
    structure: Structure,
    hidden: Whitening | None,
    first: FloatArray,
    columns: int,
    beside: list[FloatArray] | None,
    d: Drive,
    along: tuple[Along, FloatArray],
    part: IntArray,
) -> tuple[FloatArray, FloatArray]:
    """Moments of some windows of one stretch, and the errors (m, 2) of its samples there."""
    windows = [problem.windows[k] for k in part]
    stretch, tape = problem.stretches[windows[0].stretch], structure.table.tape
    begin, length, samples = places_of(windows)
    width = padded(columns)
    found, errors = np.empty((len(part), columns, columns)), np.zeros((len(stretch.samples.t), 2))
    whitens = nothing_white(len(part)) if hidden is None else hidden.of(windows[0].stretch, part)
    known = problem.known[windows[0].stretch]
    sensing = sensing_of(problem.inflation, stretch, d.sensor, along[1], known)
    if beside is not None:
        more = beside[windows[0].stretch] / sensing.weight[:, None]
        sensing = sensing._replace(value=sensing.value + more)
    moments_of_windows(
        np.ascontiguousarray(first[part]), begin, length, samples, motion_of(structure, d, stretch.h), tape.steps,
        along[0], sensing, whitens, run_for(tape, int(length.max()), width, d.channels.shape[1]),
        work_for(width, whitens.shrink.shape[1], known.states), found, errors, 0, np.zeros((0, 2, 0)),
    )  # fmt: skip
    return found, errors


def tangents_of(problem: Problem, structure: Structure, p: FloatArray, first: FloatArray) -> list[FloatArray]:
    """Per window the weighted derivatives (m, 2, 8 + np) of its samples along its first state and all parameters."""
    every: list[FloatArray] = [np.zeros(0)] * len(problem.windows)
    columns = slice(0, kernel.NX + len(structure.slots))
    driven = drives(structure, p, problem.stretches)
    first, unit = begun(problem, structure, driven, first)
    along_every = along_all(structure, p, problem.stretches, driven)
    for number, (stretch, d) in enumerate(zip(problem.stretches, driven, strict=True)):
        mine = [k for k, w in enumerate(problem.windows) if w.stretch == number]
        if not mine:
            continue
        along, sensor = along_every[number]
        sensing = sensing_of(problem.inflation, stretch, d.sensor, sensor, problem.known[number])
        windows = [problem.windows[k] for k in mine]
        rows = rows_of(structure, d, stretch, windows, first[mine], along, sensing, columns)
        rows[..., : kernel.NX] *= unit
        for k, w in zip(mine, windows, strict=True):
            every[k] = rows[w.samples]
    return every
