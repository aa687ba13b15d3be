"""What inputs hide whose entries keep time with their changes, as shapes of the channels over time.

An order that is computed ten times a second and logged as often is always as old when it is entered, in one run of the
logger: all of an input's changes come earlier than the log says by one time, which may be any within the interval. That
is no more than the inputs' changes hide which come at times of their own (``identify.bridges``), but all of it one way:
errors of the size of what a delay by T/√12 makes, in the whole of a window.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from identify.bridges import NONE, Shapes, by_delay, intervals
from identify.resample import straight_lines
from identify.stretch import SUBSTEPS, Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def phases_of(structure: Structure, p: FloatArray, stretch: Stretch, _: Sequence[tuple[int, int]]) -> Shapes:
    """One shape of every input that is not logged very often: the answer to all its changes moved alike."""
    names = [i.name for i in structure.inputs if stretch.inputs[i.name].sample_time > NONE]
    lines = [_line(structure, p, stretch, n) for n in names if int(np.sum(stretch.inputs[n].good)) > 2]
    if not lines:
        nothing = np.zeros((stretch.steps, 0, len(structure.table.channels)))
        return Shapes(nothing, nothing)
    return Shapes(np.stack([m for m, _ in lines], axis=1), np.stack([s for _, s in lines], axis=1))


def _line(structure: Structure, p: FloatArray, stretch: Stretch, name: str) -> tuple[FloatArray, FloatArray]:
    """Mean and slope (steps, channels) of what one input does where it is moved by a standard deviation."""
    spread = float(np.median(intervals(stretch.inputs[name])[1:])) / math.sqrt(12.0)
    mean, slope = straight_lines(spread * by_delay(structure, p, stretch, name), SUBSTEPS)
    return mean, slope
