"""What the columns of the tables that a run writes hold: unit and sentence of each; inputs at any times."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from preprocess.signals import SIGNALS
from preprocess.trial import FloatArray, Measurement
from preprocess.vessel import Input

UNIT_BY_KIND = {"rudder": "rad", "azimuth": "rad", "propeller": "rev/s", "thruster": "1", "tunnel": "1"}
#: What may stand behind a signal's name, and what it means.
SUFFIXES = {
    "_before": ", predicted by the declared model",
    "_after": ", predicted with the effects found",
    "_measured_good": ": 1 where the sample was used, 0 where it was set aside",
    "_measured_weight": ": variance of the sample as a multiple of the sensor's",
    "_measured": ", as measured",
}
#: Columns whose names are no signal's.
OTHERS = {
    "utc_ns": ("ns", "UTC of the row"),
    "wind_north": ("m/s", "velocity of the air over ground, north"),
    "wind_east": ("m/s", "velocity of the air over ground, east"),
}


def input_unit(declared: Input) -> str:
    """SI unit of an input's values after preprocessing."""
    return "N" if declared.unit == "N" else UNIT_BY_KIND.get(declared.kind, "1")


def _stem(column: str, inputs: Mapping[str, str]) -> tuple[str, str]:
    """Name of the signal or input in a column's name, and the suffix behind it."""
    if column in inputs:
        return column, ""
    stem = column.removeprefix("sigma_").removesuffix("_north").removesuffix("_east")
    suffix = next((s for s in SUFFIXES if stem.endswith(s)), "")
    return stem.removesuffix(suffix), suffix


def unit_of(column: str, inputs: Mapping[str, str]) -> str:
    """SI unit of a column; empty for text and for what is not known."""
    stem, suffix = _stem(column, inputs)
    if suffix in ("_measured_good", "_measured_weight"):
        return "1"
    if stem in inputs:
        return inputs[stem]
    if column in OTHERS:
        return OTHERS[column][0]
    return SIGNALS[stem].unit if stem in SIGNALS else ""


def meaning_of(column: str, inputs: Mapping[str, str] | None = None) -> str:
    """One sentence for a column, empty where there is none."""
    stem, suffix = _stem(column, inputs or {})
    if column in OTHERS:
        return OTHERS[column][1]
    if stem not in SIGNALS:
        return ""
    prefix = "standard deviation of the " if column.startswith("sigma_") else ""
    return prefix + SIGNALS[stem].sentence + SUFFIXES.get(suffix, "")


def sampled(m: Measurement, t: FloatArray) -> FloatArray:
    """A measurement at other times, (n,) or (n, 2): held for a command, else linear; NaN outside."""
    if len(m.t) == 0:
        return np.full((len(t), *m.value.shape[1:]), np.nan)
    if m.held:
        row = np.searchsorted(m.t, t, side="right") - 1
        shape = (len(t),) + (1,) * (m.value.ndim - 1)
        return np.where((row >= 0).reshape(shape), m.value[np.maximum(row, 0)], np.nan)
    columns = m.value.reshape(len(m.t), -1).T
    stacked = np.column_stack([np.interp(t, m.t, c, left=np.nan, right=np.nan) for c in columns])
    return stacked.reshape(len(t), *m.value.shape[1:])
