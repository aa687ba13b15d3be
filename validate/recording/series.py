"""Time series of one log: signals raw, cleaned and smoothed; predictions, residuals and inputs."""

from __future__ import annotations

import numpy as np
import pandas as pd
import rerun as rr

from preprocess.columns import input_unit
from preprocess.signals import SIGNALS, STATES
from preprocess.trial import FloatArray, Trial
from validate.recording import entities
from validate.recording.stream import Clock, Look, send_series
from validate.report.figures import column, sigma

PREDICTED = ("u", "v", "r", "psi")
#: state: the measurement and its component that shows it directly
DIRECT = {"x": ("position", 0), "y": ("position", 1), "psi": ("heading", None), "r": ("yaw_rate", None)}


def send_signals(
    rec: rr.RecordingStream, name: str, table: pd.DataFrame, trials: list[Trial], clock: Clock
) -> None:
    """Every state: raw, set aside, cleaned, smoothed, and its band of two standard deviations."""
    for state in STATES:
        send_raw(rec, name, state, table, trials, clock)
        joined = pd.concat([tr.states for tr in trials]).sort_values("t", kind="stable") if trials else table
        if state not in joined:
            continue
        t, smoothed = joined["t"].to_numpy(np.float64), joined[state].to_numpy(np.float64)
        look = Look("smoothed", f"{state} smoothed ({SIGNALS[state].unit})", width=2.5)
        send_series(rec, entities.signal(name, state, "smoothed"), clock, t, smoothed, look)
        spread = column(joined, f"sigma_{state}")
        for end, side in (("low", -2.0), ("high", 2.0)) if spread is not None else ():
            assert spread is not None
            edge = Look("band", f"{state} {end} (2 σ)", width=0.8)
            send_series(
                rec, entities.signal(name, state, f"band/{end}"), clock, t, smoothed + side * spread, edge
            )


def send_raw(
    rec: rr.RecordingStream, name: str, state: str, table: pd.DataFrame, trials: list[Trial], clock: Clock
) -> None:
    """Raw samples, those set aside and those kept; of a derived channel what the table has."""
    t, value, good = raw_of(state, table, trials)
    if not len(t):
        return
    for part, rows, size in (
        ("raw", np.ones(len(t), bool), 1.2),
        ("cleaned", good, 1.0),
        ("outliers", ~good, 3.5),
    ):
        if rows.any():
            look = Look(part, f"{state} {part}", points=True, width=size)
            send_series(rec, entities.signal(name, state, part), clock, t[rows], value[rows], look)


def raw_of(
    state: str, table: pd.DataFrame, trials: list[Trial]
) -> tuple[FloatArray, FloatArray, np.ndarray[tuple[int, ...], np.dtype[np.bool_]]]:
    """Times, values and whether each was kept."""
    quantity, component = DIRECT.get(state, ("", None))
    found = [tr.measurements[quantity] for tr in trials if quantity in tr.measurements]
    if found:
        values = [m.value if component is None else m.value[:, component] for m in found]
        return (
            np.concatenate([m.t for m in found]),
            np.concatenate(values),
            np.concatenate([m.good for m in found]),
        )
    measured = column(table, f"{state}_measured")
    if measured is None:
        return np.empty(0), np.empty(0), np.empty(0, bool)
    ok = np.isfinite(measured)
    return table["t"].to_numpy(np.float64)[ok], measured[ok], np.ones(int(ok.sum()), bool)


def send_predictions(
    rec: rr.RecordingStream,
    name: str,
    table: pd.DataFrame,
    trials: list[Trial],
    clock: Clock,
    parts: tuple[str, ...],
) -> None:
    """u, v, r and heading: measured, smoothed, before, after; residuals with their noise band."""
    t = table["t"].to_numpy(np.float64)
    for channel in PREDICTED:
        smoothed, unit = column(table, channel), SIGNALS[channel].unit
        if smoothed is None:
            continue
        measured = column(table, f"{channel}_measured")
        if measured is not None:
            look = Look("measured", f"{channel} measured", points=True, width=1.0)
            send_series(rec, entities.prediction(name, channel, "measured"), clock, t, measured, look)
        look = Look("smoothed", f"{channel} smoothed ({unit})", width=4.0)
        send_series(rec, entities.prediction(name, channel, "smoothed"), clock, t, smoothed, look)
        send_predicted(rec, name, channel, clock, table, parts)
        send_noise(rec, name, channel, clock, t, sigma(t, trials, channel))


def send_predicted(rec: rr.RecordingStream, name: str, channel: str, clock: Clock, table: pd.DataFrame,
                   parts: tuple[str, ...]) -> None:  # fmt: skip
    """One channel as predicted, and what is left of it."""
    t, smoothed = table["t"].to_numpy(np.float64), table[channel].to_numpy(np.float64)
    for part in parts:
        predicted = column(table, f"{channel}_{part}")
        if predicted is None:
            continue
        said = part if len(parts) > 1 else "predicted"
        look = Look(part, f"{channel} {said}")
        send_series(rec, entities.prediction(name, channel, part), clock, t, predicted, look)
        rest = Look(part, f"{channel} residual {part}" if len(parts) > 1 else f"{channel} residual")
        send_series(rec, entities.residual(name, channel, part), clock, t, smoothed - predicted, rest)


def send_noise(
    rec: rr.RecordingStream, name: str, channel: str, clock: Clock, t: FloatArray, noise: FloatArray
) -> None:
    """Two standard deviations of the smoothed measurement, either side of zero."""
    if not np.isfinite(noise).any():
        return
    for end, side in (("low", -2.0), ("high", 2.0)):
        look = Look("noise", f"{channel} noise {end} (2 σ)", width=0.8)
        send_series(rec, entities.residual(name, channel, f"noise/{end}"), clock, t, side * noise, look)


def send_inputs(rec: rr.RecordingStream, name: str, table: pd.DataFrame, actuators: pd.DataFrame | None,
                trials: list[Trial], clock: Clock) -> None:  # fmt: skip
    """Every input as it was logged and as the identified actuator made it."""
    for one in trials[0].inputs_declared if trials else ():
        logged, unit = column(table, one.name), input_unit(one)
        if logged is not None:
            look = Look("commanded", f"as logged ({unit})", width=4.0)
            path = entities.actuator(name, one.name, "commanded")
            send_series(rec, path, clock, table["t"].to_numpy(np.float64), logged, look)
        made = column(actuators, one.name) if actuators is not None else None
        if made is not None and actuators is not None:
            path = entities.actuator(name, one.name, "actuator")
            look = Look("actuator", "as made")
            send_series(rec, path, clock, actuators["t"].to_numpy(np.float64), made, look)
