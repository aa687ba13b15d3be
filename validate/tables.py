"""The tables of a run: per log, what was measured, cleaned, smoothed and predicted before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from identify.acting import actuators_of
from identify.stretch import SUBSTEPS, Stretch
from identify.structure import Structure
from preprocess.signals import STATES
from preprocess.trial import Measurement, Trial

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Measured columns: state, stream, component.
_MEASURED = (("x", "position", 0), ("y", "position", 1), ("psi", "heading", None), ("r", "yaw_rate", None))


def prediction_tables(
    trials: Sequence[Trial],
    stretches: Sequence[Stretch],
    predicts: Sequence[str],
    before: Sequence[FloatArray],
    after: Sequence[FloatArray],
) -> dict[str, pd.DataFrame]:
    """One table per log name, as the contract has it."""
    found: dict[str, list[pd.DataFrame]] = {}
    for trial in trials:
        table = _measured_table(trial)
        for label, predicted in (("before", before), ("after", after)):
            _add_prediction(table, trial, stretches, predicted, label, predicts)
        found.setdefault(trial.name, []).append(table)
    return {
        name: pd.concat(parts).sort_values("t", kind="stable", ignore_index=True)
        if len(parts) > 1
        else parts[0]
        for name, parts in found.items()
    }


def _measured_table(trial: Trial) -> pd.DataFrame:
    t = trial.states["t"].to_numpy(dtype=float)
    columns: dict[str, object] = {"t": t}
    if trial.utc_ns is not None:
        columns["utc_ns"] = trial.utc_ns + np.rint(t * 1e9).astype(np.int64)
    columns["role"] = np.full(len(t), trial.role)
    columns |= {s: trial.states[s].to_numpy(dtype=float) for s in STATES}
    columns |= {f"{s}_measured": np.full(len(t), np.nan) for s in STATES}
    table = pd.DataFrame(columns)
    for state, stream, component in _MEASURED:
        if stream in trial.measurements:
            _place(table, f"{state}_measured", trial.measurements[stream], component)
    _place_velocity(table, trial)
    for name, m in trial.inputs.items():
        table[name] = held_at(m, t)
    return table


def _place(table: pd.DataFrame, column: str, m: Measurement, component: int | None) -> None:
    value = m.value if component is None else m.value[:, component]
    rows, there = _rows(table, m.t)
    table.loc[rows, column] = value[there]


def _rows(table: pd.DataFrame, t: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Rows of the table at these times, and which of the times have one."""
    own = table["t"].to_numpy()
    rows = np.minimum(np.searchsorted(own, t - 1e-9), max(len(own) - 1, 0)).astype(np.intp)
    there = np.asarray(np.abs(own[rows] - t) < 1e-6 if len(own) else np.zeros(len(t)), dtype=bool)
    return rows[there], there


def _place_velocity(table: pd.DataFrame, trial: Trial) -> None:
    m = trial.measurements.get("velocity")
    if m is None:
        return
    rows, there = _rows(table, m.t)
    psi = table["psi"].to_numpy()[rows]
    north, east = m.value[there].T
    table.loc[rows, "u_measured"] = north * np.cos(psi) + east * np.sin(psi)
    table.loc[rows, "v_measured"] = -north * np.sin(psi) + east * np.cos(psi)


def held_at(m: Measurement, t: FloatArray) -> FloatArray:
    """The latest logged value of an input at each time; NaN where it has none at all."""
    if not len(m.t):
        return np.full(len(t), np.nan)
    rows = np.clip(np.searchsorted(m.t, t + 1e-9, side="right") - 1, 0, len(m.t) - 1)
    return np.asarray(m.value[rows], dtype=float)


def _add_prediction(
    table: pd.DataFrame,
    trial: Trial,
    stretches: Sequence[Stretch],
    predicted: Sequence[FloatArray],
    label: str,
    predicts: Sequence[str],
) -> None:
    t = table["t"].to_numpy()
    out = np.full((len(t), 6), np.nan)
    for stretch, states in zip(stretches, predicted, strict=True):
        if (stretch.name, stretch.role) == (trial.name, trial.role):
            grid = stretch.grid
            inside = (t >= grid[0] - 1e-9) & (t <= grid[-1] + 1e-9)
            out[inside] = np.column_stack([np.interp(t[inside], grid, c) for c in states.T])
    for k, state in enumerate(STATES):
        table[f"{state}_{label}"] = out[:, k] if state in predicts else np.nan


def actuator_tables(
    structure: Structure, p: FloatArray, stretches: Sequence[Stretch], tables: Mapping[str, pd.DataFrame]
) -> dict[str, pd.DataFrame]:
    """Per log: ``t`` and every input as the identified actuator made it, on the rows of the predictions."""
    values = [structure.values(p, e) for e in range(len(structure.actives))]
    out = {}
    for name, table in tables.items():
        t = table["t"].to_numpy()
        columns = {i.name: np.full(len(t), np.nan) for i in structure.inputs}
        for s in (s for s in stretches if s.name == name):
            series = actuators_of(structure, p, values, s)
            middle = s.start + s.h / SUBSTEPS * (np.arange(s.steps * SUBSTEPS) + 0.5)
            inside = (t >= s.grid[0] - 1e-9) & (t <= s.grid[-1] + 1e-9)
            for i in structure.inputs:
                columns[i.name][inside] = np.interp(t[inside], middle, series[i.name])
        out[name] = pd.DataFrame({"t": t, **columns})
    return out
