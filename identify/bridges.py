"""What inputs may have done between their samples, as shapes of the channels over time.

An order that is logged now and then changed somewhere between two samples; where, the log does not say. A change of a
channel by C at a time that may be any is, in mean, a straight line, and about it C times a Brownian bridge (the
covariance of a step at a random time is just that): √2 sin(kπx) / kπ, k = 1, 2, ... with independent sizes of variance
1, where x runs from 0 to 1 between the samples. So is a random walk between them. The first of them moves the change
by a standard deviation of about T/√12.

What an actuator that follows its order slowly makes of a change lasts beyond the next sample; the whole of
it then comes earlier or later together, and its shape is the answer to a change that is moved by T/√12.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.acting import input_clocks, shares_of
from identify.kernel import CHANNEL
from identify.resample import straight_lines
from identify.steady import values_of
from identify.stretch import SUBSTEPS, Stretch
from identify.structure import Structure
from preprocess.trial import Measurement

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Harmonics of a bridge that count; a vessel hardly answers the higher ones.
HARMONICS = (1, 2, 3, 4)
#: At most so many shapes of a window count: the largest; fewer where a log has more than so many numbers to show them.
MOST, ROOM = 96, 4_000_000
#: Of inputs that are logged more often than the first, s, one harmonic counts; than the second, none.
FEW, NONE = 0.08, 0.015
#: A longer pause in an input's log counts as so many of its intervals.
LONGEST = 4.0
#: What lasts longer is cut off after so many intervals.
MOST_APART = 60


@dataclass(frozen=True)
class Shapes:
    """Shapes of one standard deviation: means and slopes (steps, e, places).

    Each of the ``e`` columns holds another shape in every window. The ``places`` are all channels, or what is named by
    its place among the factors.
    """

    mean: FloatArray
    slope: FloatArray
    named: tuple[int, ...] | None = None

    @property
    def places(self) -> IntArray:
        """Place (c,) among the factors of everything that the shapes are of."""
        return np.array(self.named) if self.named else CHANNEL + np.arange(self.mean.shape[2])

    @property
    def count(self) -> int:
        """Columns."""
        return self.mean.shape[1]


@dataclass(frozen=True)
class _Series:
    """Shapes that do not meet in any step, one after another: number (steps,), mean and slope (steps, c) in ``places``.

    The places (c,) are those among the channels.
    """

    number: IntArray
    mean: FloatArray
    slope: FloatArray
    places: IntArray


def shapes_of(
    structure: Structure, p: FloatArray, stretch: Stretch, windows: Sequence[tuple[int, int]]
) -> Shapes:
    """Shapes of what the inputs may have done in windows of a stretch, each (first step, steps)."""
    series = [
        part
        for item in structure.inputs
        if stretch.inputs[item.name].sample_time > NONE
        for part in _series_of(structure, p, stretch, item.name)
    ]
    channels = len(structure.table.channels)
    if not series:
        nothing = np.zeros((stretch.steps, 0, channels))
        return Shapes(nothing, nothing)
    most = min(MOST, max(1, ROOM // (2 * len(stretch.samples.t))))
    column = _columns(series, _owners(stretch.steps, windows), channels, most)
    shape = (stretch.steps, int(column.max()) + 1, channels)
    mean, slope = np.zeros(shape), np.zeros(shape)
    for mine, part in zip(column, series, strict=True):
        at = np.flatnonzero(mine >= 0)
        there = at[:, None], mine[at, None], part.places
        mean[there], slope[there] = part.mean[at], part.slope[at]
    return Shapes(mean, slope)


def _owners(steps: int, windows: Sequence[tuple[int, int]]) -> IntArray:
    """Window (steps,) of every step, -1 for none."""
    out = np.full(steps, -1)
    for k, (begin, length) in enumerate(windows):
        out[begin : begin + length] = k
    return out


def _columns(series: Sequence[_Series], window: IntArray, channels: int, most: int) -> IntArray:
    """Column (series, steps) of the shape in each step: its rank in its window by size; -1 where there is none."""
    begin, owner, size = _runs(series, window, _weight(series, channels))
    owner = np.where(size > 1e-9, owner, -1)
    order = np.lexsort((-size, owner))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order)) - np.searchsorted(owner[order], owner[order])
    column = np.where((owner >= 0) & (rank < most), rank, -1)
    shape = len(series), len(window)
    return np.asarray(
        np.repeat(column, np.diff(begin, append=math.prod(shape))).reshape(shape), dtype=np.int64
    )


def _runs(
    series: Sequence[_Series], window: IntArray, weight: FloatArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Where every shape begins (r,) in the steps of all series, one after the other; its window, -1 for none; its size.

    What no shape is in, or no window, counts as a shape in none.
    """
    number = np.concatenate([s.number for s in series])
    owner = np.where(number >= 0, np.tile(window, len(series)), -1)
    change = (np.diff(number, prepend=number[:1]) != 0) | (np.diff(owner, prepend=owner[:1]) != 0)
    change[:: len(window)] = True
    begin = np.flatnonzero(change)
    size = np.concatenate([np.abs(s.mean) @ weight[s.places] for s in series])
    return begin, owner[begin], np.add.reduceat(size, begin)


def _weight(series: Sequence[_Series], channels: int) -> FloatArray:
    """Inverse (channels,) of the largest that any shape does to each channel."""
    most = np.zeros(channels)
    for s in series:
        most[s.places] = np.maximum(most[s.places], np.abs(s.mean).max(axis=0))
    return np.asarray(1.0 / (most + 1e-300))


def _series_of(structure: Structure, p: FloatArray, stretch: Stretch, name: str) -> Iterator[_Series]:
    """Shapes of one input."""
    logged = stretch.inputs[name]
    if int(np.sum(logged.good)) < 3:
        return iter(())
    lasting = _lasting(structure, p, name, float(np.abs(np.diff(logged.value[logged.good])).max()))
    if lasting > logged.sample_time:
        return _slow(structure, p, stretch, name, lasting)
    return _series(structure, p, stretch, name)


def _lasting(structure: Structure, p: FloatArray, name: str, change: float) -> float:
    """How long, s, what acts on an input still answers to a change of it."""
    return sum(
        a.effect.lasting(structure.values(p, k), change)
        for k, a in enumerate(structure.actives)
        if a.effect.lasting and name in a.variant.inputs
    )


def _slow(
    structure: Structure, p: FloatArray, stretch: Stretch, name: str, lasting: float
) -> Iterator[_Series]:
    """Answers of an input that lasts: every so manieth change is moved at once."""
    logged = stretch.inputs[name]
    begin, part = input_clocks(structure, p, stretch)[name], stretch.h / SUBSTEPS
    change, _ = _places(logged, begin + part * (np.arange(stretch.steps * SUBSTEPS, dtype=float) + 0.5))
    apart = min(MOST_APART, 2 + math.ceil(lasting / logged.sample_time))
    spread = intervals(logged) / math.sqrt(12.0)
    still, step = put_in(structure, p, stretch, name), 0.5 * part
    which = np.cumsum(logged.good) - 1
    for turn in range(apart):
        moved = put_in(structure, p, _moved(stretch, name, step * (which % apart == turn)), name)
        owner = change - (change - turn) % apart
        size = np.where(owner >= 0, spread[np.maximum(owner, 0)], 0.0)
        number = owner.reshape(-1, SUBSTEPS).max(axis=1)
        mean, slope = straight_lines((moved - still) * (size / step), SUBSTEPS)
        yield _Series(np.maximum(number, -1), mean, slope, np.arange(len(still)))


def _series(structure: Structure, p: FloatArray, stretch: Stretch, name: str) -> Iterator[_Series]:
    """Shapes of one input, every harmonic apart, and every change from those in the same step."""
    logged = stretch.inputs[name]
    begin, part = input_clocks(structure, p, stretch)[name], stretch.h / SUBSTEPS
    at = begin + part * (np.arange(stretch.steps * SUBSTEPS, dtype=float) + 0.5)
    change, x = _places(logged, at)
    delayed = by_delay(structure, p, stretch, name)
    acts = np.flatnonzero(delayed.any(axis=1))
    changes = int(change.max()) + 1
    total = np.array([np.bincount(change, row * part, changes) for row in delayed[acts]])
    moved = total.reshape(len(acts), changes)[:, change]
    inside, apart = (x > 0.0) & (x < 1.0), math.ceil(stretch.h / logged.sample_time) + 1
    turns = np.array([inside & (change % apart == turn) for turn in range(apart)])
    numbers = np.where(turns, change, -1).reshape(apart, -1, SUBSTEPS).max(axis=2)
    for k in _showing(logged.sample_time, stretch.h):
        wave = moved * (_spread(k, logged.held) * np.sin(k * math.pi * x))
        for mine, number in zip(turns, numbers, strict=True):
            mean, slope = straight_lines(wave * mine, SUBSTEPS)
            yield _Series(number, mean, slope, acts)


def _showing(interval: float, step: float) -> tuple[int, ...]:
    """Harmonics that show of an input with such an interval, s: those whose halves last half a step, at least two."""
    return HARMONICS[: max(2, round(2.0 * interval / step))] if interval > FEW else HARMONICS[:1]


def _spread(harmonic: int, held: bool) -> float:
    """Standard deviation of a harmonic; a held input, which switches midway, is no straight line but for even ones."""
    bridge = math.sqrt(2.0) / (harmonic * math.pi)
    step = 2.0 / (harmonic * math.pi) if held and harmonic % 2 == 0 else 0.0
    return math.hypot(bridge, step)


def _places(logged: Measurement, at: FloatArray) -> tuple[IntArray, FloatArray]:
    """Number of the change that each time ``at`` (n,) on an input's log belongs to, and where it is in it, 0 to 1.

    A held input switches at its sample's time; the change may come half an interval earlier or later.
    """
    t, interval = logged.t[logged.good], intervals(logged)
    end = t + 0.5 * interval if logged.held else t
    change = np.minimum(np.searchsorted(np.maximum.accumulate(end), at), len(t) - 1)
    return change, 1.0 - (end[change] - at) / np.maximum(interval[change], 1e-9)


def intervals(logged: Measurement) -> FloatArray:
    """How long before each of an input's samples its change may have come, s."""
    t = logged.t[logged.good]
    return np.asarray(np.minimum(np.diff(t, prepend=t[0]), LONGEST * logged.sample_time))


def by_delay(structure: Structure, p: FloatArray, stretch: Stretch, name: str) -> FloatArray:
    """Derivatives (channels, steps · SUBSTEPS) of the channels by a delay of one input."""
    step = 0.5 * stretch.h / SUBSTEPS
    later, earlier = (put_in(structure, p, _moved(stretch, name, shift), name) for shift in (step, -step))
    return (later - earlier) / (2.0 * step)


def put_in(structure: Structure, p: FloatArray, stretch: Stretch, name: str) -> FloatArray:
    """What all that may answer to an input puts into the channels (channels, steps · SUBSTEPS)."""
    out = np.zeros((len(structure.table.channels), stretch.steps * SUBSTEPS))
    for share in shares_of(structure, p, values_of(structure, p), stretch, (name,)):
        out[list(share.places)] += share.fine
    return out


def _moved(stretch: Stretch, name: str, shift: FloatArray | float) -> Stretch:
    logged = stretch.inputs[name]
    return replace(stretch, inputs={**stretch.inputs, name: replace(logged, t=logged.t + shift)})
