"""report.json: the schema, the numbers, what is not known."""

import json
import math
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from benchmarks.results_example import example_results
from identify.fit import FittedEffect
from preprocess.trial import Measurement
from validate.diagnosis import ChannelScore
from validate.report import report_of, report_schema
from validate.report.contents import gaps
from validate.report.names import file_names
from validate.report.page import report_page
from validate.report.schema import to_json


def test_the_folder_holds_what_the_contract_lists(example_folder, example):
    assert {p.name for p in example_folder.iterdir()} == {
        "report.json", "report.html", "model.json", "recording.rrd", "predictions", "trial"}  # fmt: skip
    tables = {f"{t.name.split('/')[-1]}.parquet" for t in example.trials}
    assert {p.name for p in (example_folder / "predictions").iterdir()} == tables
    assert {p.name for p in (example_folder / "trial").iterdir()} == tables


def test_report_json_fits_its_own_schema(example_folder):
    report = json.loads((example_folder / "report.json").read_text())
    jsonschema.Draft202012Validator(report_schema()).validate(report)
    assert report["schema"] == "seatrial.report/1"
    assert report["validation"]["before"]["channels"]["u"].keys() == {"mse", "rmse", "r2", "nrmse"}
    assert report["diagnosis"]["verdict"] == "ambiguous"
    assert [r["accepted"] for r in report["diagnosis"]["rounds"]] == ["current", None]


def test_the_schema_refuses_a_report_with_a_key_too_many_or_too_few(example):
    report = json.loads(to_json(report_of(example)))
    check = jsonschema.Draft202012Validator(report_schema())
    assert not check.is_valid({**report, "extra": 1})
    del report["vessel"]
    assert not check.is_valid(report)


def test_report_json_carries_the_numbers_of_the_results(example):
    report = json.loads(to_json(report_of(example)))
    assert report["validation"]["after"]["position_rmse"] == example.validation_after.position_rmse
    assert [p["value"] for p in report["parameters"]] == [p.value for p in example.after.coefficients]
    log = report["logs"][0]
    assert (log["path"], log["bytes_damaged"]) == ("logs/zigzag0.nmea", 312)
    position = log["signals"][0]
    assert position["rate_hz"] == pytest.approx(5.0)
    assert position["outliers"] == (~example.trials[0].measurements["position"].good).sum()


def test_effects_carry_their_options_beside_their_name(example):
    effect = example.diagnosis.effects[0]
    fitted = FittedEffect("input_wiring", None, (), {"swapped": ("left", "right"), "logs": ["a.bin"]})
    changed = replace(example.diagnosis, effects=(replace(effect, fitted=fitted),))
    entry = json.loads(to_json(report_of(replace(example, diagnosis=changed))))["diagnosis"]["effects"][0]
    assert entry["swapped"] == ["left", "right"]
    assert entry["logs"] == ["a.bin"]
    assert "form" not in entry


def test_without_the_loop_diagnosis_is_null():
    report = json.loads(to_json(report_of(example_results(loop=False))))
    assert report["diagnosis"] is None
    assert report["validation"]["before"] == report["validation"]["after"]


def test_nan_and_infinity_become_null(example):
    score = ChannelScore(math.nan, math.inf, None, np.float64("nan"))
    broken = replace(example.validation_after, channels={"u": score}, fitness=math.nan)
    words = to_json(report_of(replace(example, validation_after=broken)))
    assert "NaN" not in words
    assert "Infinity" not in words
    after = json.loads(words)["validation"]["after"]
    assert after["channels"]["u"] == {"mse": None, "rmse": None, "r2": None, "nrmse": None}
    assert after["fitness"] is None


def test_the_error_of_a_candidate_that_ran_away_is_null_and_the_page_says_so(example):
    first = example.diagnosis.rounds[0]
    lost = replace(first.candidates[0], rmse_before={"u": math.inf, "v": math.inf, "r": math.inf})
    turn = replace(first, candidates=(lost, *first.candidates[1:]))
    results = replace(example, diagnosis=replace(example.diagnosis, rounds=(turn,)))
    report = json.loads(to_json(report_of(results)))
    jsonschema.Draft202012Validator(report_schema()).validate(report)
    entries = report["diagnosis"]["rounds"][0]["candidates"]
    assert {"u": None, "v": None, "r": None} in [c["rmse_before"] for c in entries]
    page = report_page(results)
    assert "u runs away →" in page
    assert "says nothing of its error above" in page


def test_a_log_whose_last_third_validates_is_one_entry_with_both_roles(example):
    first = example.trials[0]
    parts = (replace(first, role="identify"), replace(first, role="validate"))
    logs = report_of(replace(example, trials=parts)).logs
    assert [(entry.path, entry.role) for entry in logs[:1]] == [("logs/zigzag0.nmea", "both")]
    assert logs[0].signals[0].outliers == 2 * report_of(example).logs[0].signals[0].outliers


@pytest.mark.parametrize("campaign", ["campaign.toml", "harbour/campaign.toml", "/data/campaign.toml"])
def test_logs_of_one_name_in_two_folders_are_told_apart(campaign):
    results, names = example_results(logs=2, duration=5.0), ("sub/c.csv", "c.csv")
    trials = tuple(replace(t, name=n) for t, n in zip(results.trials, names, strict=True))
    logs = tuple(
        replace(log, path=Path(campaign).parent / n, messages=m)
        for log, n, m in zip(results.logs, names, (1, 2), strict=True)
    )
    found = report_of(replace(results, campaign=campaign, logs=logs, trials=trials)).logs
    assert [(log.path, log.messages) for log in found] == [("sub/c.csv", 1), ("c.csv", 2)]
    assert file_names(names) == {"sub/c.csv": "sub_c.csv", "c.csv": "c.csv"}


def test_gaps_are_counted_against_the_sample_time():
    t = np.array([0.0, 0.1, 0.2, 1.2, 1.3, 2.9, 3.0])
    assert gaps(Measurement("heading", t, t, 0.1, t > -1)) == 2
