"""What the plots of a recording show: the measurement whole, and predictions as far as they stay near it."""

from __future__ import annotations

import numpy as np
import pandas as pd

from preprocess.signals import STATES
from preprocess.trial import Trial
from validate.recording.series import PREDICTED, raw_of
from validate.report.figures import column, sigma
from validate.report.names import slug
from validate.report.svg import limits_of

#: How many spans of the measurement a plot reaches beyond it.
PREDICTIONS, RESIDUALS, RAW = 0.6, 2.0, 1.0
Range = tuple[float, float]


def ranges_of(table: pd.DataFrame, actuators: pd.DataFrame | None, trials: list[Trial]) -> dict[str, Range]:
    """Smallest and largest value of every plot of a log, by its place under the log's root."""
    return predicted(table, trials) | signals(table, trials) | inputs(table, actuators, trials)


def predicted(table: pd.DataFrame, trials: list[Trial]) -> dict[str, Range]:
    """Predictions and residuals."""
    out: dict[str, Range] = {}
    t = table["t"].to_numpy(np.float64)
    for c in PREDICTED:
        smoothed = column(table, c)
        found = [p for s in ("_after", "_before") if (p := column(table, c + s)) is not None]
        if smoothed is None or not found:
            continue
        out[f"prediction/{c}"] = limits_of([smoothed], found, PREDICTIONS)
        left = [smoothed - p for p in found]
        noise = 2.0 * sigma(t, trials, c)
        low, high = limits_of(left[:1], [*left, noise, -noise], RESIDUALS)
        out[f"residual/{c}"] = min(low, 0.0), max(high, 0.0)
    return out


def signals(table: pd.DataFrame, trials: list[Trial]) -> dict[str, Range]:
    """Raw and smoothed; outliers as far as they are near."""
    out: dict[str, Range] = {}
    for state in STATES:
        smoothed, (_, raw, _) = column(table, state), raw_of(state, table, trials)
        if smoothed is not None:
            out[f"signals/{state}"] = limits_of([smoothed], [raw], RAW)
    return out


def inputs(table: pd.DataFrame, actuators: pd.DataFrame | None, trials: list[Trial]) -> dict[str, Range]:
    """Inputs as logged and as made."""
    out: dict[str, Range] = {}
    sources = [table] if actuators is None else [table, actuators]
    for one in trials[0].inputs_declared if trials else ():
        found = [v for source in sources if (v := column(source, one.name)) is not None]
        if found:
            out[f"inputs/{slug(one.name)}"] = limits_of(found)
    return out
