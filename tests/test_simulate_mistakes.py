"""What `simulate` is told and cannot do, and model files that are none: said, not left out."""

from __future__ import annotations

import json
import math

import pytest
from identification_samples import PROPELLER, RUDDER
from test_simulate import BLANKE, blanke, fit_of
from typer.testing import CliRunner

from identify.fit import Estimated, FittedEffect
from identify.simulate import Order, simulate
from ingest.errors import UsageError
from seatrial.cli.app import make_app
from validate.report.model_file import ModelFileError, read_model, write_model


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("--speed", "approach speed must be positive"),
        ("--helm-rate", "rate of the helm must be positive"),
        ("--log", "names the log '0'; it names none"),
        ("--prime --speed", "refer to must be positive"),
    ],
)
def test_an_option_that_cannot_be_is_said_and_not_left_out(tmp_path, option, said):
    write_model(blanke(), tmp_path / "model.json")
    words = ["simulate", str(tmp_path / "model.json"), "circle 35", *option.split(), "0", "--samples", "0"]
    found = CliRunner().invoke(make_app(), words).exception
    assert isinstance(found, UsageError)
    assert said in str(found)


@pytest.mark.parametrize("manoeuvre", ["circle 95", "zigzag 120/20", "circle 0"])
def test_a_helm_that_no_rudder_has_is_refused(manoeuvre):
    with pytest.raises(
        UsageError, match=r"helm of \d+° cannot be given: expected more than 0°, and at most 90°"
    ):
        simulate(blanke(), manoeuvre)


@pytest.mark.parametrize("manoeuvre", [None, 20, ("zigzag", 20)])
def test_what_is_no_order_is_said_with_what_would_be_one(manoeuvre):
    with pytest.raises(
        UsageError, match=r"manoeuvre: expected words such as 'zigzag 20/20', or an Order, found"
    ):
        simulate(blanke(), manoeuvre)


def test_a_helm_beyond_that_of_the_logs_is_called_an_extrapolation(tmp_path):
    write_model(blanke(largest_inputs={"rudder": math.radians(20.0), "n": 12.0}), tmp_path / "model.json")
    fit = read_model(tmp_path / "model.json")
    said = "A helm of 35° is an extrapolation: in the logs rudder never goes beyond ±20°."
    assert said in simulate(fit, Order("circle", math.radians(35.0), samples=0)).notes
    for order in ("zigzag 20/20", "circle 15", "stopping"):
        assert not [n for n in simulate(fit, order).notes if "helm" in n]


def test_a_log_whose_loading_holds_is_one_that_an_effect_names():
    ratio = Estimated("", "ratio", 1.5, 0.01, "1")
    loaded = FittedEffect("mass_change", None, (ratio,), {"logs": ["heavy.csv"]})
    fit = fit_of(BLANKE, "blanke", (RUDDER, PROPELLER), effects=(loaded,), typical_inputs={"n": 12.0})
    light, heavy = (simulate(fit, Order("zigzag", samples=0, log=name)) for name in (None, "heavy.csv"))
    assert heavy["first_overshoot"].value != light["first_overshoot"].value
    with pytest.raises(UsageError, match=r"it names heavy\.csv"):
        simulate(fit, Order("zigzag", samples=0, log="havy.csv"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m: m["parameters"].pop(), r"covariance: expected 12 rows of 12.*found 13 rows of 13"),
        (
            lambda m: m["covariance"][3].pop(),
            r"covariance: expected 13 rows of 13.*found 13 rows of 12 or 13",
        ),
        (lambda m: m["covariance"].clear(), r"covariance: expected 13 rows of 13.*found 0 rows"),
        (lambda m: m["covariance"][0].__setitem__(0, float("nan")), "is not JSON: NaN is no number"),
    ],
)
def test_a_model_file_that_contradicts_itself_is_refused(tmp_path, change, said):
    path = tmp_path / "model.json"
    write_model(blanke(spread=0.01), path)
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    with pytest.raises(ModelFileError, match=said):
        read_model(path)
