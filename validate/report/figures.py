"""The figures of the report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from preprocess.columns import input_unit
from preprocess.trial import FloatArray, Trial
from validate.report.svg import BETWEEN, BOTTOM, HEIGHT, TOP, Axes, Series, finite_range, limits_of, stack

DEG = 180.0 / np.pi
#: channel, what it is, unit for reading, factor from SI
CHANNELS = (
    ("u", "surge speed", "m/s", 1.0),
    ("v", "sway speed", "m/s", 1.0),
    ("r", "yaw rate", "°/s", DEG),
    ("psi", "heading", "°", DEG),
)
#: Predictions beyond this (SI) are drawn there.
RUNAWAY = 1e12
SYMBOL = {"psi": "ψ"}


@dataclass(frozen=True)
class Figure:
    """An SVG with its caption."""

    caption: str
    svg: str


def column(table: pd.DataFrame, name: str, scale: float = 1.0) -> FloatArray | None:
    """A column as floats, or None where it is absent or wholly empty; what ran away ends at `RUNAWAY`."""
    if name not in table:
        return None
    values = np.clip(table[name].to_numpy(np.float64, na_value=np.nan), -RUNAWAY, RUNAWAY) * scale
    return values if np.isfinite(values).any() else None


def channel_figure(name: str, log: str, table: pd.DataFrame, trials: list[Trial], channel: str, two: bool,
                   score: str, carried: pd.DataFrame | None = None) -> Figure | None:  # fmt: skip
    """One channel of one log: measured and predicted above, residuals with their noise band below.

    Parameters
    ----------
    name : str
        Unique on the page.
    two : bool
        Whether there is a prediction without and one with effects; else only the latter is drawn.
    score : str
        What the caption adds.
    carried : DataFrame, optional
        What the first state's error makes of the prediction (``validate.carried``); the band counts it.
    """
    _, words, unit, scale = next(c for c in CHANNELS if c[0] == channel)
    t, smoothed = table["t"].to_numpy(np.float64), column(table, channel, scale)
    before = column(table, f"{channel}_before", scale) if two else None
    after, raw = column(table, f"{channel}_after", scale), column(table, f"{channel}_measured", scale)
    if smoothed is None or (after is None and before is None):
        return None
    predicted = [p for p in (before, after) if p is not None]
    series = [Series("smooth", t, smoothed)]
    series += [Series("raw", t, raw, "dots")] if raw is not None else []
    series += [Series(s, t, p) for s, p in (("before", before), ("after", after)) if p is not None]
    symbol = SYMBOL.get(channel, channel)
    guests = predicted + ([raw] if raw is not None else [])
    upper = Axes(f"{symbol}, {unit}", tuple(series), limits_of([smoothed], guests))
    noise = np.hypot(sigma(t, trials, channel), carried_sigma(t, carried, channel)) * scale
    lower = _residual_axes(t, smoothed, before, after, noise, unit)
    span = finite_range([t])
    label = f"{words} of {log} against time: measured and predicted, with residuals below; {score}"
    caption = f"{symbol}, {words}" + (f" · {score}" if score else "")
    return Figure(caption, stack(name, label, [upper, lower], span))


def sigma(t: FloatArray, trials: list[Trial], channel: str) -> FloatArray:
    """Standard deviation of the smoothed measurement at the table's times; NaN where it is not known."""
    out = np.full(len(t), np.nan)
    for trial in trials:
        states = trial.states
        if f"sigma_{channel}" not in states or not len(states):
            continue
        value = np.interp(t, states["t"], states[f"sigma_{channel}"], left=np.nan, right=np.nan)
        out = np.where(np.isfinite(value), value, out)
    return out


def carried_sigma(t: FloatArray, carried: pd.DataFrame | None, channel: str) -> FloatArray:
    """Standard deviation that the first state's error makes of a prediction; 0 where it is not known."""
    if carried is None or channel not in carried or len(carried) != len(t):
        return np.zeros(len(t))
    return np.asarray(np.nan_to_num(carried[channel].to_numpy(np.float64), nan=0.0, posinf=RUNAWAY))


def _residual_axes(t: FloatArray, smoothed: FloatArray, before: FloatArray | None, after: FloatArray | None,
                   noise: FloatArray, unit: str) -> Axes:  # fmt: skip
    left = {"before": before, "after": after}
    residual = {k: smoothed - p for k, p in left.items() if p is not None}
    series = [Series("band", t, 2 * noise, "band", -2 * noise)] if np.isfinite(noise).any() else []
    series += [Series(k, t, r) for k, r in residual.items()]
    core = residual.get("after", next(iter(residual.values())))
    guests = [*residual.values(), 2 * noise, -2 * noise]
    usual = 2 * np.nanmedian(noise) if np.isfinite(noise).any() else 0.0
    low, high = limits_of([core, np.array([-usual, usual])], guests, reach=2.0)
    return Axes(f"Δ, {unit}", tuple(series), (min(low, 0.0), max(high, 0.0)), height=64)


def input_figure(name: str, log: str, table: pd.DataFrame, actuators: pd.DataFrame | None,
                 trials: list[Trial]) -> Figure | None:  # fmt: skip
    """Every input of one log as it was logged, and as the identified actuator made it where that differs."""
    declared = trials[0].inputs_declared if trials else ()
    t = table["t"].to_numpy(np.float64)
    count = max(1, sum(i.name in table for i in declared))
    high = max(40, (HEIGHT - TOP - BOTTOM + BETWEEN) // count - BETWEEN)
    axes = []
    for one in declared:
        unit = input_unit(one)
        scale, shown = (DEG, "°") if unit == "rad" else (1.0, "" if unit == "1" else unit)
        logged = column(table, one.name, scale)
        if logged is None:
            continue
        made = (
            column(actuators, one.name, scale) if actuators is not None and len(actuators) == len(t) else None
        )
        series = [Series("smooth", t, logged)]
        if made is not None and not np.allclose(made, logged, equal_nan=True):
            series.append(Series("after", t, made))
        label = f"{one.name}, {shown}" if shown else one.name
        axes.append(Axes(label, tuple(series), limits_of([s.y for s in series]), high))
    if not axes:
        return None
    names = ", ".join(i.name for i in declared)
    return Figure(
        f"Inputs · {names}", stack(name, f"inputs of {log} against time: {names}", axes, finite_range([t]))
    )
