"""A trial as a Parquet file and back, equal.

One row per distinct time of any sensor or input. The smoothed states stand in the columns of
``Trial.states``; each measurement in columns of its own (``heading_measured``; ``position_measured_0``,
``_1``; ``…_good``; inputs as ``input_NAME``), empty between its samples; what is not a column (units,
uncertainties, history, vessel) is JSON in the file's metadata under ``seatrial.trial``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from preprocess.signals import SIGNALS
from preprocess.trial import FloatArray, Measurement, Step, Trial
from preprocess.vessel import Input, Vessel

SCHEMA = "seatrial.trial/1"
KEY = b"seatrial.trial"
_TUPLES = ("antenna", "imu", "position", "centre_of_gravity", "added_mass", "pwm", "value")


def write_trial(trial: Trial, path: Path) -> None:
    """Write a trial; see the module for the layout.

    Parameters
    ----------
    trial : Trial
    path : Path
        Its folder is made where it is not there.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = dict(_columns(trial))
    table = pa.table(columns)
    meta = json.dumps(_metadata(trial), ensure_ascii=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table.replace_schema_metadata({KEY: meta.encode()}), path, compression="zstd")


def read_trial(path: Path) -> Trial:
    """Read what :func:`write_trial` wrote.

    Raises
    ------
    ValueError
        If the file is not a trial of a known schema.
    """
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    meta = json.loads((table.schema.metadata or {}).get(KEY, b"{}"))
    if meta.get("schema") != SCHEMA:
        raise ValueError(f"{path}: expected a trial of schema {SCHEMA}, found {meta.get('schema')}")
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    return _trial(meta, columns)


def _labels(trial: Trial) -> Iterator[tuple[str, Measurement]]:
    for name, m in trial.measurements.items():
        yield f"{name}_measured", m
    for name, m in trial.inputs.items():
        yield f"input_{name}", m


def _columns(trial: Trial) -> Iterator[tuple[str, Any]]:
    """Columns on the union of all times; a flag tells the rows of the states from the rest."""
    parts = list(_labels(trial))
    own = trial.states["t"].to_numpy()
    t = np.unique(np.concatenate([own, *(m.t for _, m in parts)]))
    yield "t", t
    if trial.utc_ns is not None:
        yield "utc_ns", trial.utc_ns + np.round(t * 1e9).astype(np.int64)
    yield "is_state", np.isin(t, own)
    at = np.searchsorted(t, own)
    for name in trial.states.columns.drop("t"):
        yield name, _spread(trial.states[name].to_numpy(), at, len(t))
    for label, m in parts:
        at = np.searchsorted(t, m.t)
        value = m.value if m.value.ndim == 2 else m.value[:, None]
        for k in range(value.shape[1]):
            yield (label if m.value.ndim == 1 else f"{label}_{k}"), _spread(value[:, k], at, len(t))
        yield f"{label}_good", _spread(m.good.astype(float), at, len(t))


def _spread(values: FloatArray, at: Any, n: int) -> FloatArray:
    out = np.full(n, np.nan)
    out[at] = values
    return out


def _metadata(trial: Trial) -> dict[str, Any]:
    skip = ("states", "measurements", "inputs")
    plain = {f.name: getattr(trial, f.name) for f in fields(trial) if f.name not in skip}
    plain["vessel"], plain["inputs_declared"] = (
        asdict(trial.vessel),
        [asdict(i) for i in trial.inputs_declared],
    )
    plain["history"] = [asdict(s) for s in trial.history]
    about = {"measurements": {k: _about(m) for k, m in trial.measurements.items()}}
    about["inputs"] = {k: _about(m) for k, m in trial.inputs.items()}
    units = {name: s.unit for name, s in SIGNALS.items()}
    states = list(trial.states.columns)
    return {"schema": SCHEMA, **_jsonable(plain), **about, "units": units, "state_columns": states}


def _about(m: Measurement) -> dict[str, Any]:
    out = {f.name: getattr(m, f.name) for f in fields(m) if f.name not in ("t", "value", "good")}
    return {
        **_jsonable(out),
        "components": 1 if m.value.ndim == 1 else m.value.shape[1],
        "flat": m.value.ndim == 1,
    }


def _jsonable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _jsonable(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_jsonable(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value


def _trial(meta: dict[str, Any], columns: Mapping[str, Any]) -> Trial:
    rows = columns["is_state"]
    states = pd.DataFrame({name: columns[name][rows] for name in meta["state_columns"]})
    names = {f.name for f in fields(Trial)}
    plain = {k: v for k, v in meta.items() if k in names}
    return Trial(
        **plain
        | {
            "vessel": Vessel(**_tuples(meta["vessel"])),
            "inputs_declared": tuple(Input(**_tuples(i)) for i in meta["inputs_declared"]),
            "measurements": _measurements(meta["measurements"], columns, "{}_measured"),
            "inputs": _measurements(meta["inputs"], columns, "input_{}"),
            "states": states,
            "segments": tuple((float(a), float(b)) for a, b in meta["segments"]),
            "origin": None if meta["origin"] is None else tuple(meta["origin"]),
            "findings": tuple(meta["findings"]),
            "history": tuple(Step(s["action"], s["arguments"]) for s in meta["history"]),
        }
    )


def _tuples(values: dict[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if k in _TUPLES and v is not None else v for k, v in values.items()}


def _measurements(about: dict[str, Any], columns: Mapping[str, Any], label: str) -> dict[str, Measurement]:
    return {name: _measurement(a, columns, label.format(name)) for name, a in about.items()}


def _measurement(about: dict[str, Any], columns: Mapping[str, Any], label: str) -> Measurement:
    flag = columns[f"{label}_good"]
    rows = np.isfinite(flag)
    parts = [label] if about["flat"] else [f"{label}_{k}" for k in range(about["components"])]
    value = np.column_stack([columns[p][rows] for p in parts])
    plain = {k: v for k, v in about.items() if k not in ("components", "flat")}
    plain["sigma"] = float("nan") if plain["sigma"] is None else plain["sigma"]
    return Measurement(
        t=columns["t"][rows], value=value[:, 0] if about["flat"] else value, good=flag[rows] > 0.5, **plain
    )
