"""Trials read back from the files that ``preprocess.storage`` writes, equal to what was written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from preprocess.storage import SCHEMA, component_columns
from preprocess.trial import BoolArray, FloatArray, Measurement, Step, Trial
from preprocess.vessel import Input, Vessel

_TUPLES = ("antenna", "imu", "position", "centre_of_gravity", "added_mass", "pwm", "value")


def read_trial(path: Path) -> Trial:
    """Read a file that holds one trial.

    Raises
    ------
    ValueError
        If it is not of a known schema, or holds several (:func:`read_trials`).
    """
    trials = read_trials(path)
    if len(trials) != 1:
        raise ValueError(f"{path}: expected one trial, found {len(trials)}; read_trials reads them all")
    return trials[0]


def read_trials(path: Path) -> tuple[Trial, ...]:
    """Read the trials of a log.

    Parameters
    ----------
    path : Path
        As ``trial/FILENAME.parquet`` of a results folder.

    Returns
    -------
    tuple of Trial

    Raises
    ------
    ValueError
        If it is not a file of a known schema.
    """
    import pyarrow.parquet as pq

    table = pq.read_table(path)
    raw = table.schema.metadata or {}
    schema = json.loads(raw[b"schema"]) if b"schema" in raw else None
    if schema != SCHEMA:
        raise ValueError(f"{path}: expected a trial of schema {SCHEMA}, found {schema}")
    facts = {k: json.loads(raw[k.encode()]) for k in ("log", "vessel", "inputs", "parts")}
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    return tuple(_trial(facts, part, columns, columns["part"] == k) for k, part in enumerate(facts["parts"]))


def _trial(
    facts: Mapping[str, Any], part: Mapping[str, Any], columns: Mapping[str, Any], mine: BoolArray
) -> Trial:
    rows = columns["is_state"] & mine
    return Trial(
        name=facts["log"],
        role=part["role"],
        vessel=Vessel(**_tuples(facts["vessel"])),
        inputs_declared=tuple(Input(**_tuples(i)) for i in facts["inputs"]),
        measurements={k: _measurement(k, a, columns) for k, a in part["measurements"].items()},
        inputs={k: _measurement(k, a, columns) for k, a in part["inputs"].items()},
        states=pd.DataFrame({name: columns[name][rows] for name in part["state_columns"]}),
        segments=tuple((float(a), float(b)) for a, b in part["segments"]),
        start=part["start"],
        utc_ns=part["utc_ns"],
        origin=None if part["origin"] is None else (part["origin"][0], part["origin"][1]),
        manoeuvre=part["manoeuvre"],
        findings=tuple(part["findings"]),
        history=tuple(Step(s["action"], s["arguments"]) for s in part["history"]),
        depth=part["depth"],
    )


def _tuples(values: dict[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if k in _TUPLES and v is not None else v for k, v in values.items()}


def _measurement(name: str, about: dict[str, Any], columns: Mapping[str, Any]) -> Measurement:
    label, flat = f"{name}_measured", about["flat"]
    flag, t = columns[f"{label}_good"], columns["t"]
    low, high = about["span"] or (np.inf, -np.inf)
    rows = np.isfinite(flag) & (t >= low) & (t <= high)
    values: list[FloatArray] = [columns[c][rows] for c in component_columns(label, flat)]
    plain = {k: v for k, v in about.items() if k not in ("flat", "weighted", "span")}
    return Measurement(
        t=t[rows],
        value=values[0] if flat else np.column_stack(values),
        good=flag[rows] > 0.5,
        weight=columns[f"{label}_weight"][rows] if about["weighted"] else None,
        **plain,
    )
