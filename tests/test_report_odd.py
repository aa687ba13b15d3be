"""Odd results: gaps, nothing known, nothing predicted, a boat that lies still."""

import json
import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from benchmarks.results_example import STATES, example_results
from validate.diagnosis import ChannelScore
from validate.report import report_schema
from validate.report_files import write_results


def with_gap(results):
    """The first log with nothing known for ten seconds, twice."""
    name = "logs/zigzag0.nmea"
    table, trial = results.predictions[name].copy(), results.trials[0]
    hole = table["t"].between(10, 20)
    columns = [c for c in table if c not in ("t", "utc_ns", "role", "rudder", "n")]
    table.loc[hole, columns] = np.nan
    states = trial.states.copy()
    states.loc[hole, [c for c in states if c != "t"]] = np.nan
    pieces = replace(trial, states=states, segments=((0.0, 10.0), (20.0, 29.95)))
    return replace(results, predictions={name: table}, trials=(pieces,))


def without_uncertainty(results):
    """Nothing known of how well the parameters are known."""
    blank = tuple(
        replace(p, stderr=math.nan, identifiable=False, reason="") for p in results.after.coefficients
    )
    fit = replace(
        results.after, coefficients=blank, covariance=np.empty((0, 0)), effects=(), chi2_per_dof=math.nan
    )
    return replace(results, after=fit, before=fit, diagnosis=None, equations=())


def yaw_alone(results):
    """A model that predicts nothing but r and psi, as Nomoto's do."""
    drop = [s + x for s in ("x", "y", "u", "v") for x in ("_before", "_after")]
    predictions = {k: t.assign(**dict.fromkeys(drop, np.nan)) for k, t in results.predictions.items()}
    none = ChannelScore(None, None, None, None)
    scores = {**results.validation_after.channels, "u": none, "v": none}
    validation = replace(results.validation_after, channels=scores, position_rmse=None, fitness=None)
    return replace(
        results, predictions=predictions, validation_before=validation, validation_after=validation
    )


def only_heading(results):
    """A log without fixes, whose reader found nothing else to say."""
    trial = results.trials[0]
    sensors = {k: m for k, m in trial.measurements.items() if k == "heading"}
    less = replace(trial, measurements=sensors, origin=None, utc_ns=None, findings=(), manoeuvre=None)
    return replace(results, trials=(less,), logs=(), actuators={}, papers=(), timing_s={})


def nothing_predicted(results):
    """Trials, but not one table of predictions."""
    return replace(results, predictions={}, actuators={})


def still_boat(results):
    """A boat that lies still: constant columns, a prediction that runs away."""
    name = "logs/zigzag0.nmea"
    table = results.predictions[name].copy()
    for state in STATES:
        table[state] = 0.0
        table[f"{state}_after"] = np.geomspace(1e-3, 1e300, len(table))
    return replace(results, predictions={name: table})


@pytest.mark.parametrize(
    "change", [with_gap, without_uncertainty, yaw_alone, only_heading, nothing_predicted, still_boat]
)
def test_odd_results_are_written_too(tmp_path, change):
    results = change(example_results(logs=1, duration=30.0))
    write_results(results, tmp_path)
    report = json.loads((tmp_path / "report.json").read_text())
    jsonschema.Draft202012Validator(report_schema()).validate(report)
    for svg in re.findall(r"<svg.*?</svg>", (tmp_path / "report.html").read_text(), re.S):
        assert "nan" not in svg
        ET.fromstring(svg)
    assert (tmp_path / "recording.rrd").stat().st_size > 1000
