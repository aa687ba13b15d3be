"""What the compiled code takes, from what drives a stretch and what was measured in it."""

from __future__ import annotations

import numpy as np

from identify.drive import Drive
from identify.sample import Motion, Sensing
from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def motion_of(structure: Structure, d: Drive, h: float) -> Motion:
    """What drives a stretch, for the compiled code."""
    rows = structure.table.tape.rows(d.coefficients)
    discrete = structure.model.discrete
    return Motion(h, discrete, structure.u0, d.channels, d.slopes, d.fine, d.wind, d.current, rows)


def sensing_of(inflation: FloatArray, stretch: Stretch, sensor: FloatArray, along: FloatArray) -> Sensing:
    """A stretch's samples on its grid, each stream's clock offset taken off; ``inflation`` (4,) of their σ."""
    samples = stretch.samples
    t = samples.t - sensor[5:9][samples.kind] - stretch.start
    weight = 1.0 / (samples.sigma * inflation[samples.kind])
    used = np.asarray(along.any(axis=1), dtype=np.int64)
    return Sensing(t, samples.kind, samples.value, weight, sensor, along, used)
