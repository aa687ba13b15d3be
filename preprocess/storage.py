"""The trials of a log as one Parquet file, and back, equal (``preprocess.restore``).

One row per distinct time of any sensor or input. The smoothed states stand in the columns of ``Trial.states``, each
input at every row under its name (as it was held, or straight between samples). The samples themselves have columns of
their own, empty between them: ``heading_measured``; ``position_measured_north``, ``…_east``; inputs as
``rudder_measured``; each with ``…_good``. What is not a column (uncertainties of the sensors, history, vessel) is JSON
in the file's metadata: ``schema``, ``log``, ``vessel``, ``inputs`` and ``parts``, one entry per trial; units and a
sentence stand in the metadata of the columns. A log that is several trials has one file; ``part`` and ``role`` tell its
rows apart, ``is_state`` those of the states.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from preprocess.columns import input_unit, meaning_of, sampled, unit_of
from preprocess.trial import FloatArray, Measurement, Trial

if TYPE_CHECKING:
    import pyarrow as pa

SCHEMA = "seatrial.trial/1"
#: Endings of the columns of what has two components.
COMPONENTS = ("_north", "_east")
#: What of a trial is not in its metadata, or stands there once for all parts.
_APART = ("states", "measurements", "inputs", "vessel", "inputs_declared", "name", "history")


def write_trial(trial: Trial, path: Path) -> None:
    """Write one trial; see :func:`write_trials`."""
    write_trials((trial,), path)


def write_trials(trials: Sequence[Trial], path: Path) -> None:
    """Write the trials of one log, in order of time; see the module for the layout.

    Parameters
    ----------
    trials : sequence of Trial
        Of one log and vessel; they do not overlap.
    path : Path
        Its folder is made where it is not there.

    Raises
    ------
    ValueError
        If they overlap in time.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = _columns(trials)
    units = {i.name: input_unit(i) for i in trials[0].inputs_declared}
    schema = [
        pa.field(n, a.type, metadata={"unit": unit_of(n, units), "description": meaning_of(n, units)})
        for n, a in columns.items()
    ]
    table = pa.table(list(columns.values()), schema=pa.schema(schema, metadata=_metadata(trials)))
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path, compression="zstd")


def write_folder(trials: Iterable[Trial], folder: Path, files: Mapping[str, str]) -> list[Path]:
    """Write ``FILENAME.parquet`` for each log, by the names of ``files``; returns the paths."""
    logs: dict[str, list[Trial]] = {}
    for trial in trials:
        logs.setdefault(trial.name, []).append(trial)
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{files[name]}.parquet" for name in logs]
    for path, parts in zip(paths, logs.values(), strict=True):
        write_trials(parts, path)
    return paths


def component_columns(label: str, flat: bool) -> tuple[str, ...]:
    """Names of the columns of a measurement's values."""
    return (label,) if flat else tuple(label + c for c in COMPONENTS)


def _columns(trials: Sequence[Trial]) -> dict[str, pa.Array]:
    """All columns, in their order."""
    own = [_own_times(p) for p in trials]
    spans = sorted((x[0], x[-1]) for x in own if len(x))
    if any(a[1] >= b[0] for a, b in itertools.pairwise(spans)):
        raise ValueError(f"{trials[0].name}: the trials of a log overlap in time")
    t = np.unique(np.concatenate([*own, *(m.t for p in trials for m in p.inputs.values())]))
    part = _part_of(t, own)
    first = trials[0]
    out: dict[str, Any] = {"t": t}
    if first.utc_ns is not None:
        out["utc_ns"] = first.utc_ns + np.rint(t * 1e9).astype(np.int64)
    out |= {"role": np.array([p.role for p in trials])[part], "part": part}
    out["is_state"] = np.isin(t, np.concatenate([p.states["t"].to_numpy(float) for p in trials]))
    for name in first.states.columns.drop("t"):
        out[name] = _gathered(t, ((p.states["t"].to_numpy(float), p.states[name].to_numpy()) for p in trials))
    out |= {k: c for k, c in _everywhere(trials, t, part).items() if k not in out}
    for kind in ("measurements", "inputs"):
        for name in dict.fromkeys(k for p in trials for k in getattr(p, kind)):
            parts = [getattr(p, kind)[name] for p in trials if name in getattr(p, kind)]
            out |= _samples(f"{name}_measured", parts, t)
    return {name: _array(c) for name, c in out.items()}


def _array(column: Any) -> pa.Array:
    """A column as Arrow has it; what is not a number is empty."""
    import pyarrow as pa

    return pa.array(column, from_pandas=True)


def _own_times(p: Trial) -> FloatArray:
    """Distinct times of a trial's states and sensors, s."""
    return np.unique(np.concatenate([p.states["t"].to_numpy(float), *(m.t for m in p.measurements.values())]))


def _part_of(t: FloatArray, own: Sequence[FloatArray]) -> Any:
    """Which trial each row belongs to: the last that has begun; (n,) int64."""
    begins = np.array([x[0] if len(x) else np.inf for x in own])
    order = np.argsort(begins, kind="stable")
    at = np.searchsorted(begins[order], t, side="right") - 1
    return order[np.maximum(at, 0)]


def _gathered(t: FloatArray, parts: Iterable[tuple[FloatArray, Any]]) -> FloatArray:
    """Values at their own times, spread over the rows; NaN elsewhere."""
    out = np.full(len(t), np.nan)
    for at, values in parts:
        out[np.searchsorted(t, at)] = values
    return out


def _samples(label: str, parts: Sequence[Measurement], t: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Values, verdicts and (where there are any) weights of a sensor or an input in all its parts."""
    flat = parts[0].value.ndim == 1
    for k, name in enumerate(component_columns(label, flat)):
        yield name, _gathered(t, ((m.t, m.value if flat else m.value[:, k]) for m in parts))
    yield f"{label}_good", _gathered(t, ((m.t, m.good.astype(float)) for m in parts))
    if any(m.weight is not None for m in parts):
        weights = ((m.t, np.ones(len(m.t)) if m.weight is None else m.weight) for m in parts)
        yield f"{label}_weight", _gathered(t, weights)


def _everywhere(trials: Sequence[Trial], t: FloatArray, part: Any) -> dict[str, FloatArray]:
    """Inputs, wind and depth at every row, as they were held or straight between samples."""
    out: dict[str, FloatArray] = {}
    for k, p in enumerate(trials):
        mine = part == k
        found = {name: sampled(m, t[mine]) for name, m in p.inputs.items()}
        if "depth" in p.measurements:
            found["depth"] = sampled(p.measurements["depth"], t[mine])
        if "wind" in p.measurements:
            wind = sampled(p.measurements["wind"], t[mine])
            found |= {"wind_north": wind[:, 0], "wind_east": wind[:, 1]}
        for name, values in found.items():
            out.setdefault(name, np.full(len(t), np.nan))[mine] = values
    return out


def _metadata(trials: Sequence[Trial]) -> dict[str, str]:
    first = trials[0]
    facts = {
        "schema": SCHEMA,
        "log": first.name,
        "vessel": asdict(first.vessel),
        "inputs": [asdict(i) for i in first.inputs_declared],
        "parts": [_part(p) for p in trials],
    }
    return {k: json.dumps(_jsonable(v), ensure_ascii=False) for k, v in facts.items()}


def _part(p: Trial) -> dict[str, Any]:
    """What is not a column of one trial."""
    plain = {f.name: getattr(p, f.name) for f in fields(p) if f.name not in _APART}
    return plain | {
        "state_columns": list(p.states.columns),
        "measurements": {k: _about(m) for k, m in p.measurements.items()},
        "inputs": {k: _about(m) for k, m in p.inputs.items()},
        "history": [{"action": s.action, "arguments": s.arguments} for s in p.history],
    }


def _about(m: Measurement) -> dict[str, Any]:
    """What is not a column of a measurement, and the times between which its samples lie."""
    plain = {f.name: getattr(m, f.name) for f in fields(m) if f.name not in ("t", "value", "good", "weight")}
    span = [float(m.t[0]), float(m.t[-1])] if len(m.t) else None
    return plain | {"flat": m.value.ndim == 1, "weighted": m.weight is not None, "span": span}


def _jsonable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _jsonable(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_jsonable(v) for v in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value.item() if isinstance(value, np.generic) else value
