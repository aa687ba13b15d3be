"""The tables: predictions and trials as Parquet, and the names of their files."""

import json
from dataclasses import replace
from pathlib import PurePath

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
from hypothesis import given
from hypothesis import strategies as st
from preprocess_samples import assert_same_trial

from benchmarks.results_example import STATES, example_results
from preprocess.columns import sampled
from preprocess.restore import read_trials
from preprocess.trial import Measurement
from validate.report.names import file_names, slug
from validate.report_files import write_results


def test_predictions_have_the_contract_columns_with_units(example_folder, example):
    file = pq.ParquetFile(example_folder / "predictions" / "zigzag0.nmea.parquet")
    schema = file.schema_arrow
    suffixes = ("", "_measured", "_before", "_after")
    expected = {"t", "utc_ns", "role", "rudder", "n", *(s + x for s in STATES for x in suffixes)}
    assert set(schema.names) == expected
    unit = {f.name: f.metadata[b"unit"].decode() for f in schema}
    assert (unit["r_after"], unit["x_measured"], unit["rudder"], unit["n"]) == ("rad/s", "m", "rad", "rev/s")
    assert json.loads(schema.metadata[b"log"]) == "logs/zigzag0.nmea"
    table = file.read().to_pandas()
    original = example.predictions["logs/zigzag0.nmea"]
    np.testing.assert_array_equal(table["u_after"], original["u_after"])
    np.testing.assert_array_equal(table["utc_ns"], original["utc_ns"])
    assert file.read().column("x_measured").null_count == original["x_measured"].isna().sum() > 0


def test_utc_is_left_out_where_it_is_not_known(tmp_path):
    write_results(example_results(logs=1, duration=10.0, utc=False, origin=None), tmp_path)
    assert "utc_ns" not in pq.read_schema(tmp_path / "predictions" / "zigzag0.nmea.parquet").names


def test_a_state_that_is_not_predicted_is_there_and_empty(tmp_path):
    results = example_results(logs=1, duration=10.0)
    name = "logs/zigzag0.nmea"
    less = results.predictions[name].drop(columns=["u_before", "u_after", "v_before", "v_after"])
    write_results(replace(results, predictions={name: less}), tmp_path)
    table = pd.read_parquet(tmp_path / "predictions" / "zigzag0.nmea.parquet")
    assert table["u_after"].isna().all()
    assert "Δ, °/s" in (tmp_path / "report.html").read_text()


def test_trials_keep_uncertainty_units_and_history(example_folder, example):
    file = pq.ParquetFile(example_folder / "trial" / "circle1.nmea.parquet")
    table, trial = file.read().to_pandas(), example.trials[1]
    assert table["t"].is_monotonic_increasing and table["t"].is_unique
    rows = table[table["is_state"]]
    np.testing.assert_array_equal(rows["sigma_u"], trial.states["sigma_u"])
    np.testing.assert_array_equal(rows["rudder"], trial.inputs["rudder"].value)
    part = json.loads(file.schema_arrow.metadata[b"parts"])[0]
    assert part["history"][0] == {
        "action": "outliers",
        "arguments": {"quantity": "position", "threshold": 4.0},
    }
    assert part["origin"] == list(trial.origin)
    unit = {f.name: f.metadata[b"unit"].decode() for f in file.schema_arrow}
    shown = ("sigma_r", "rudder", "rudder_measured", "position_measured_east", "heading_measured_good")
    assert [unit[k] for k in shown] == ["rad/s", "rad", "rad", "m", "1"]


def test_the_trials_of_the_results_folder_are_read_back_equal(example_folder, example):
    for trial in example.trials:
        (back,) = read_trials(example_folder / "trial" / f"{PurePath(trial.name).name}.parquet")
        assert_same_trial(back, trial)


def test_commands_are_held_and_sensors_interpolated():
    t, value = np.array([0.0, 1.0]), np.array([0.0, 2.0])
    command = Measurement("rudder", t, value, 0.0, t > -1, held=True)
    at = np.array([-0.5, 0.5, 1.5])
    np.testing.assert_array_equal(sampled(command, at), [np.nan, 0.0, 2.0])
    np.testing.assert_array_equal(sampled(replace(command, held=False), at), [np.nan, 1.0, np.nan])


def test_logs_that_share_a_file_name_get_files_of_their_own():
    names = file_names(["a/x.nmea", "b/x.nmea", "y.bin", "../c/b/x.nmea"])
    assert names["y.bin"] == "y.bin"
    assert len(set(names.values())) == 4
    assert not any("/" in n for n in names.values())


@given(st.lists(st.text("ab/._", min_size=1, max_size=8), min_size=1, max_size=6, unique=True))
def test_file_names_are_unique_and_plain(names):
    made = file_names(names)
    assert len(set(made.values())) == len(names)
    assert all("/" not in n and n not in ("", ".", "..") and slug(n) for n in made.values())
