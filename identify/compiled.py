"""What the compiled code takes, from what drives a stretch and what was measured in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from identify.directions import Directions, all_directions
from identify.drive import Drive
from identify.innovations import NO_FILTER, Filter
from identify.kernel import NM, NX
from identify.measure import moments_of_windows
from identify.sample import Motion, Sensing, nothing_white, work_for
from identify.stretch import Stretch
from identify.structure import Structure
from identify.tangents import Along, padded, run_for

if TYPE_CHECKING:
    from identify.windows import Window

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def motion_of(structure: Structure, d: Drive, h: float) -> Motion:
    """What drives a stretch, for the compiled code."""
    rows = structure.table.tape.rows(d.coefficients)
    discrete = structure.model.discrete
    return Motion(h, discrete, d.u0, d.channels, d.slopes, d.fine, d.wind, d.current, rows)


def sensing_of(
    inflation: FloatArray, stretch: Stretch, sensor: FloatArray, along: FloatArray, known: Filter = NO_FILTER
) -> Sensing:
    """A stretch's samples on its grid, each stream's clock offset taken off; ``inflation`` (4,) of their σ.

    With a filter what is known of a drift of its positions, and of waves, is taken off.
    """
    samples = stretch.samples
    t = samples.t - sensor[5:9][samples.kind] - stretch.start
    weight = 1.0 / (samples.sigma * inflation[samples.kind])
    used = np.asarray(along.any(axis=1), dtype=np.int64)
    return Sensing(t, samples.kind, samples.value, weight, sensor, along, used, known)


def places_of(windows: Sequence[Window]) -> tuple[IntArray, IntArray, IntArray]:
    """First step (w,), number of steps (w,), and first and last sample (w, 2) of windows."""
    begin, length = (np.array([getattr(w, n) for w in windows], dtype=np.int64) for n in ("first", "steps"))
    return begin, length, np.array([(w.samples.start, w.samples.stop) for w in windows], dtype=np.int64)


def rows_of(
    structure: Structure, d: Drive, stretch: Stretch, windows: Sequence[Window], first: FloatArray,
    along: Along, sensing: Sensing, columns: slice,
) -> FloatArray:  # fmt: skip
    """Weighted derivatives (m, 2, k) of a stretch's samples in its ``windows``, along some of the ``columns``.

    ``first`` (w, 8) are the windows' first states; column 8 is the first of ``along``.
    """
    begin, length, samples = places_of(windows)
    tape, width = structure.table.tape, along.current.shape[1]
    rows = np.zeros((len(stretch.samples.t), 2, columns.stop - columns.start))
    nothing = np.zeros((len(rows), 2))
    moments_of_windows(
        np.ascontiguousarray(first), begin, length, samples, motion_of(structure, d, stretch.h), tape.steps, along,
        sensing, nothing_white(len(begin)), run_for(tape, int(length.max()), width, d.channels.shape[1]),
        work_for(width, states=sensing.known.states), np.empty((len(begin), 1, 1)), nothing, columns.start, rows,
    )  # fmt: skip
    return rows


def nothing_along(columns: int) -> Along:
    """The directions where no parameter moves, for so many columns."""
    places, numbers, none = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 0))
    return Along(
        places, places, places, numbers, places, places, places, numbers, places, places, places, none, none,
        np.zeros((2, padded(columns))),
    )  # fmt: skip


def no_sensors(columns: int) -> FloatArray:
    """Derivatives (9, width) of the sensors' parameters where none moves."""
    return np.zeros((NM, padded(columns)))


def along_all(
    structure: Structure, p: FloatArray, stretches: Sequence[Stretch], driven: Sequence[Drive]
) -> list[tuple[Along, FloatArray]]:
    """The directions of all parameters in every stretch, for the compiled code."""
    every = all_directions(structure, p, stretches, driven)
    return [along_of(structure, ways, d) for ways, d in zip(every, driven, strict=True)]


def along_of(structure: Structure, d: Directions, here: Drive) -> tuple[Along, FloatArray]:
    """The directions of all parameters, in the order of the slots after the first state, for the compiled code.

    The second, (9, width), are the derivatives of the sensors' parameters along them.
    """
    tape, equation = structure.table.tape, structure.table.equation_of
    simple, general = structure.simple, structure.general
    plain = structure.layout.plain
    moved, which = np.nonzero(d.coefficients)
    value = tape.value.astype(np.int64)
    width = padded(NX + len(structure.slots) + 1)
    current, sensor = np.zeros((2, width)), np.zeros((NM, width))
    current[:, NX + general], sensor[:, NX + general] = d.current, d.sensor
    along = Along(
        NX + simple, value[plain], equation[plain], here.factor[plain], NX + general[moved], value[which],
        equation[which], d.coefficients[moved, which], NX + general, d.driven[:, 0].copy(),
        NX + general[d.driven[:, 1]], d.values, d.slopes, current,
    )  # fmt: skip
    return along, sensor
