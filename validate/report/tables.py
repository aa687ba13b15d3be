"""The Parquet tables: predictions and preprocessed trials, with units and history in the metadata."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from preprocess.signals import SIGNALS, STATES
from preprocess.trial import FloatArray, Measurement, Trial
from preprocess.vessel import Input
from validate.report.schema import plain

UNIT_BY_KIND = {"rudder": "rad", "azimuth": "rad", "propeller": "rev/s", "thruster": "1", "tunnel": "1"}
SUFFIXES = ("_measured", "_before", "_after")


def input_unit(declared: Input) -> str:
    """SI unit of an input's values after preprocessing."""
    return "N" if declared.unit == "N" else UNIT_BY_KIND.get(declared.kind, "1")


def unit_of(column: str, inputs: Mapping[str, str]) -> str:
    """SI unit of a column; empty for text and for what is not known."""
    stem = column.removeprefix("sigma_")
    for suffix in SUFFIXES:
        stem = stem.removesuffix(suffix)
    if column in inputs:
        return inputs[column]
    known = {"utc_ns": "ns", "wind_north": "m/s", "wind_east": "m/s"}
    return SIGNALS[stem].unit if stem in SIGNALS else known.get(stem, "")


def meaning_of(column: str) -> str:
    """One sentence for a column, empty where there is none."""
    stem = column.removeprefix("sigma_")
    last = next((s for s in SUFFIXES if stem.endswith(s)), "")
    stem = stem.removesuffix(last)
    if stem not in SIGNALS:
        return ""
    prefix = "standard deviation of the " if column.startswith("sigma_") else ""
    tail = {"_measured": ", as measured", "_before": ", predicted by the declared model",
            "_after": ", predicted with the effects found"}.get(last, "")  # fmt: skip
    return prefix + SIGNALS[stem].sentence + tail


def write_table(
    table: pd.DataFrame, path: Path, inputs: Iterable[Input], metadata: Mapping[str, object]
) -> None:
    """Write a table; NaN becomes null, units go into the fields' metadata, facts into the file's as JSON."""
    units = {i.name: input_unit(i) for i in inputs}
    arrow = pa.Table.from_pandas(table.reset_index(drop=True), preserve_index=False)
    fields = [
        f.with_metadata({"unit": unit_of(f.name, units), "description": meaning_of(f.name)})
        for f in arrow.schema
    ]
    facts = {key: json.dumps(plain(value), ensure_ascii=False) for key, value in metadata.items()}
    pq.write_table(arrow.cast(pa.schema(fields, metadata=facts)), path, compression="zstd")


def prediction_table(table: pd.DataFrame) -> pd.DataFrame:
    """The contract's columns in the contract's order; ``utc_ns`` only where it is known."""
    if "utc_ns" in table and table["utc_ns"].isna().all():
        table = table.drop(columns="utc_ns")
    elif "utc_ns" in table:
        table = table.assign(utc_ns=table["utc_ns"].astype("Int64"))
    states = [s + suffix for suffix in ("", "_measured") for s in STATES]
    predicted = [s + suffix for suffix in ("_before", "_after") for s in STATES]
    absent = {c: np.nan for c in states + predicted if c not in table}
    head = [c for c in ("t", "utc_ns", "role") if c in table]
    inputs = [c for c in table if c not in {*head, *states, *predicted}]
    return table.assign(**absent)[head + states + inputs + predicted]


def write_predictions(predictions: Mapping[str, pd.DataFrame], inputs: Iterable[Input], folder: Path,
                      files: Mapping[str, str], metadata: Mapping[str, object]) -> list[Path]:  # fmt: skip
    """Write ``FILENAME.parquet`` for each log; returns the paths in the same order."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{files[name]}.parquet" for name in predictions]
    for path, (name, table) in zip(paths, predictions.items(), strict=True):
        write_table(prediction_table(table), path, inputs, {"log": name, **metadata})
    return paths


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


def trial_table(trial: Trial) -> pd.DataFrame:
    """One row per time: role, states with uncertainties, inputs; wind and depth where they were logged."""
    t = trial.states["t"].to_numpy(np.float64)
    more: dict[str, FloatArray] = {name: sampled(m, t) for name, m in trial.inputs.items()}
    if "wind" in trial.measurements:
        wind = sampled(trial.measurements["wind"], t)
        more |= {"wind_north": wind[:, 0], "wind_east": wind[:, 1]}
    if "depth" in trial.measurements:
        more["depth"] = sampled(trial.measurements["depth"], t)
    table = pd.concat([trial.states, pd.DataFrame(more, index=trial.states.index)], axis=1)
    table.insert(1, "role", trial.role)
    if trial.utc_ns is not None:
        table.insert(1, "utc_ns", trial.utc_ns + np.rint(t * 1e9).astype(np.int64))
    return table


def trial_facts(trial: Trial) -> dict[str, object]:
    """What does not fit into a column: origin, clock, segments, sensors, findings, history."""
    sensors = {
        m.name: {"source": m.source, "sigma": m.sigma, "samples": len(m.t), "set_aside": dict(m.reasons)}
        for m in [*trial.measurements.values(), *trial.inputs.values()]
    }
    return {
        "role": trial.role,
        "origin": trial.origin,
        "start": trial.start,
        "utc_ns": trial.utc_ns,
        "manoeuvre": trial.manoeuvre,
        "depth": trial.depth,
        "segments": trial.segments,
        "sensors": sensors,
        "findings": trial.findings,
        "history": [{"action": s.action, "arguments": s.arguments} for s in trial.history],
    }


def write_trials(trials: Iterable[Trial], folder: Path, files: Mapping[str, str]) -> list[Path]:
    """Write one file per log; the parts of a divided log follow each other, each with its role."""
    folder.mkdir(parents=True, exist_ok=True)
    grouped: dict[str, list[Trial]] = {}
    for trial in trials:
        grouped.setdefault(trial.name, []).append(trial)
    paths = []
    for name, parts in grouped.items():
        path = folder / f"{files[name]}.parquet"
        table = pd.concat([trial_table(p) for p in parts]).sort_values("t", kind="stable")
        facts = {"log": name, "vessel": parts[0].vessel.__dict__, "parts": [trial_facts(p) for p in parts]}
        write_table(table, path, parts[0].inputs_declared, facts)
        paths.append(path)
    return paths
