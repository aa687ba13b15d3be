"""The Parquet tables of predictions, with units in the metadata; of trials, see ``preprocess.storage``."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from preprocess.columns import input_unit, meaning_of, unit_of
from preprocess.signals import STATES
from preprocess.vessel import Input
from validate.report.schema import plain


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
