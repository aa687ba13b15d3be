"""What inputs hide that were rounded as they were logged, as shapes of the channels over time.

A rudder that is held at 12.34° and logged as 12.3° is off by the same amount for as long as it is held, and again
wherever it is put to the same level: one unknown constant per level, of the standard deviation of a uniform error,
step/√12. How large it is, is known; it is not estimated. What acts is what the actuator makes of it: behind a lag a
level's error comes and goes as slowly as the level, and a slow rudder has it from when it arrives until it has left for
the next. The errors of an input that moves from one sample to the next are independent and average out, and those of
one that passes slowly through a level add up to nothing: neither counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from identify.acting import input_clocks
from identify.bridges import MOST, Shapes, put_in
from identify.resample import straight_lines
from identify.stretch import SUBSTEPS, Stretch
from identify.structure import Structure
from preprocess.trial import Measurement

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
#: An input and the value at which it is held.
Level = tuple[str, float]

#: A value counts as held from so many samples on, and for so many steps of the integration.
SAMPLES, STEPS = 2, 2.0
#: A level that changes the channels by less than this share of what the largest of a window does is left out.
SHARE = 0.02
#: An actuator answers to the last so many levels at most: so many drives tell what each level of a log does.
LAST = 3


def rounding_of(
    structure: Structure, p: FloatArray, stretch: Stretch, windows: Sequence[tuple[int, int]]
) -> Shapes:
    """Shapes of what rounding may have hidden in windows of a stretch, each (first step, steps); the largest first."""
    each = levels_in(structure, p, stretch, windows)
    shape = (stretch.steps, max((len(e) for e in each), default=0), len(structure.table.channels))
    mean, slope = np.zeros(shape), np.zeros(shape)
    for (a, n), found in zip(windows, each, strict=True):
        for k, (_, fine) in enumerate(found):
            mean[a : a + n, k], slope[a : a + n, k] = straight_lines(fine, SUBSTEPS)
    return Shapes(mean, slope)


def levels_in(
    structure: Structure, p: FloatArray, stretch: Stretch, windows: Sequence[tuple[int, int]]
) -> list[list[tuple[Level, FloatArray]]]:
    """Per window its levels, the largest first, and what a standard deviation of each changes the channels by.

    That is (channels, steps · SUBSTEPS) of the window.
    """
    acting = [part for i in structure.inputs for part in _answers(structure, p, stretch, i.name)]
    return [_largest(acting, slice(a * SUBSTEPS, (a + n) * SUBSTEPS)) for a, n in windows]


def held_levels(logged: Measurement, least: float) -> IntArray:
    """Number of the level (n,) at which an input is held in each of its good samples, -1 where it moves.

    It is held where it has the same value in several samples, for ``least`` seconds, and did not come from one side
    by one step to leave on the other by one: that is a slow passage.
    """
    t, value = logged.t[logged.good], logged.value[logged.good]
    number = np.round((value - value.min()) / logged.quantum).astype(np.int64)
    begin = np.flatnonzero(np.diff(number, prepend=number[0] - 1))
    count = np.diff(np.append(begin, len(number)))
    lasts = np.diff(np.append(t[begin], t[-1] + logged.sample_time))
    change = np.diff(number[begin])
    before, after = np.append(0, change), np.append(change, 0)
    passing = (np.abs(before) == 1) & (before == after)
    held = (count >= SAMPLES) & (lasts >= least) & ~passing
    level = np.where(held, np.unique(number[begin], return_inverse=True)[1], -1)
    return np.asarray(np.repeat(level, count), dtype=np.int64)


def _answers(
    structure: Structure, p: FloatArray, stretch: Stretch, name: str
) -> Iterator[tuple[list[Level], IntArray, FloatArray]]:
    """Levels of an input; which of them (steps · SUBSTEPS,) each time answers to; what by (channels, steps · SUBSTEPS).

    Behind actuators, one for every third time that the input is held: a level's answer may then last until the one
    after the next.
    """
    logged = stretch.inputs[name]
    if not logged.quantum > 0.0 or int(np.sum(logged.good)) < SAMPLES:
        return
    level, value = held_levels(logged, STEPS * stretch.h), logged.value[logged.good]
    names = [(name, float(value[level == k].min(initial=np.inf))) for k in range(level.max() + 1)]
    begins = np.diff(level, prepend=-1) != 0
    begins &= level >= 0
    time, at = np.cumsum(begins), _fine_times(structure, p, stretch, name)
    last = LAST if any(a.effect.actuator for a in structure.actives) else 1
    for some in np.unique(time[begins] % last):
        mine = time % last == some
        first = np.flatnonzero(begins & mine)
        since = logged.t[logged.good][first if logged.held else np.maximum(first - 1, 0)]
        which = np.searchsorted(since - stretch.h / SUBSTEPS, at, side="right") - 1
        owner = np.where(which >= 0, level[first][which], -1)
        yield names, owner, _answer(structure, p, stretch, name, mine & (level >= 0))


def _fine_times(structure: Structure, p: FloatArray, stretch: Stretch, name: str) -> FloatArray:
    """Times (steps · SUBSTEPS,) on an input's log of what acts."""
    part = stretch.h / SUBSTEPS
    begin = input_clocks(structure, p, stretch)[name]
    return np.asarray(begin + part * (np.arange(stretch.steps * SUBSTEPS, dtype=float) + 0.5), dtype=float)


def _answer(
    structure: Structure, p: FloatArray, stretch: Stretch, name: str, samples: np.ndarray
) -> FloatArray:
    """What one standard deviation of rounding in some good samples changes the channels by (channels, fine times)."""
    half = 0.5 * stretch.inputs[name].quantum / math.sqrt(12.0)
    more, less = (put_in(structure, p, _off(stretch, name, by * samples), name) for by in (half, -half))
    return more - less


def _off(stretch: Stretch, name: str, by: FloatArray) -> Stretch:
    """The stretch with one input's good samples off by (n,)."""
    logged = stretch.inputs[name]
    value = logged.value.copy()
    value[logged.good] += by
    return replace(stretch, inputs={**stretch.inputs, name: replace(logged, value=value)})


def _largest(
    acting: Sequence[tuple[list[Level], IntArray, FloatArray]], part: slice
) -> list[tuple[Level, FloatArray]]:
    """What each level's rounding changes the channels by within a part of the fine grid, the largest first."""
    sums: dict[Level, FloatArray] = {}
    for names, owner, by in acting:
        here = owner[part]
        for k in np.unique(here[here >= 0]):
            sums[names[k]] = sums.get(names[k], 0.0) + by[:, part] * (here == k)
    if not sums:
        return []
    scale = np.max([np.abs(by).max(axis=1, keepdims=True) for by in sums.values()], axis=0) + 1e-300
    size = {name: float(np.sum(np.abs(by) / scale)) for name, by in sums.items()}
    order = sorted((n for n in sums if size[n] > SHARE * max(size.values())), key=lambda n: -size[n])
    return [(name, sums[name]) for name in order[:MOST]]
