"""No input is driven beyond its range, and what no log has, a command or a speed, is called an extrapolation."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pandas as pd
import pytest
from identification_samples import MOTORS
from test_simulate import blanke, fit_of

from identify.similar import similar
from identify.simulate import Order, simulate
from identify.simulate.helm import greatest
from preprocess.vessel import Input
from seatrial.operating_point import with_operating_point
from validate.report.model_file import read_model, write_model

CATAMARAN = {
    ("u", "u"): -0.5, ("u", "T:thruster"): 2.0, ("v", "v"): -1.0, ("v", "ur"): -0.5, ("r", "r"): -1.0,
    ("r", "N:thruster"): 6.0,
}  # fmt: skip
HARD = math.radians(35.0)


def catamaran(inputs=MOTORS, ahead=0.7, per=1.0, **options):
    """The catamaran with ``per`` as much thrust per command."""
    typical = {i.name: ahead for i in inputs}
    own = {k: v * per if "thruster" in k[1] else v for k, v in CATAMARAN.items()}
    return fit_of(own, "modulus", inputs, typical_inputs=typical, **options)


def notes(fit, *order, **more):
    return [n for n in simulate(fit, Order(*order, samples=0, **more)).notes if "extrapolation" in n]


def test_a_thruster_whose_commands_are_shares_goes_no_further_than_one():
    found = simulate(catamaran(), Order("circle", HARD, samples=0))
    assert {found.inputs["left"].max(), found.inputs["right"].max()} == {1.0, 0.0}
    (said,) = [n for n in found.notes if n.startswith("A helm of")]
    assert "left 1, right 0" in said
    assert "doubles the outer one, which goes no further than 1)" in said


@pytest.mark.parametrize("unit", ["N", None])
def test_one_in_newtons_has_no_such_range(unit):
    """Where the log states the unit, the campaign need not."""
    inputs = tuple(replace(m, unit=unit, law="linear") for m in MOTORS)
    fit = catamaran(inputs, 20.0, 0.02, largest_inputs={"left": 45.0, "right": 45.0})
    found = simulate(fit, Order("circle", HARD, samples=0))
    assert found.inputs["left"].max() == pytest.approx(40.0)
    assert not any("no further" in n for n in found.notes)


@pytest.mark.parametrize(
    ("item", "logged", "most"),
    [
        (Input("a", "thruster"), 0.9, 1.0),
        (Input("a", "thruster"), 1.1, 1.1),
        (Input("a", "tunnel", unit="percent"), 0.0, 1.0),
        (Input("a", "propeller", unit="percent"), 0.8, 1.0),
        (Input("a", "thruster", value=(-0.8, 0.0, 0.9)), 0.5, 0.9),
        (Input("a", "thruster", unit="rpm"), 0.9, math.inf),
        (Input("a", "propeller"), 0.9, math.inf),
        (Input("a", "rudder", unit="percent"), 0.3, math.inf),
    ],
)
def test_the_range_of_an_input_is_what_is_known_of_it(item, logged, most):
    assert greatest(item, logged) == most


def test_a_speed_that_takes_more_than_there_is_is_not_held():
    found = simulate(catamaran(), Order("circle", HARD, speed=20.0, samples=0))
    assert max(v.max() for v in found.inputs.values()) <= 1.0
    assert any("No thrust holds 20 m/s" in n for n in found.notes)


def test_every_command_that_the_logs_do_not_have_is_said():
    fit = catamaran(largest_inputs={"left": 0.8, "right": 0.97})
    assert notes(fit, "circle", HARD) == [
        "A command of left 1 is an extrapolation: in the logs it never goes beyond 0.8."
    ]
    assert notes(fit, "circle", HARD / 8) == []
    propelled = blanke(largest_inputs={"rudder": 0.8, "n": 12.0})
    assert notes(propelled, "circle", HARD) == []
    (said,) = notes(propelled, "circle", HARD, speed=3.0)
    assert said.startswith("A command of n ")
    assert said.endswith("it never goes beyond 12.")


def test_an_approach_at_a_speed_that_no_log_has_is_said_with_those_that_they_have():
    fit = blanke(speeds=(0.4, 1.5))
    for speed in (10.0, 0.3):
        (said,) = notes(fit, "circle", HARD, speed=speed)
        assert said == f"An approach at {speed:g} m/s is an extrapolation: the logs have 0.4 to 1.5 m/s."
    for near in (0.39, 1.0, 1.55):
        assert notes(fit, "circle", HARD, speed=near) == []
    assert notes(blanke(), "circle", HARD, speed=10.0) == []


def test_a_model_file_holds_the_speeds_and_one_without_them_is_read(tmp_path):
    path = tmp_path / "model.json"
    write_model(blanke(speeds=(0.4, 1.5)), path)
    assert read_model(path).speeds == (0.4, 1.5)
    old = json.loads(path.read_text(encoding="utf-8"))
    del old["provenance"]["speeds"]
    path.write_text(json.dumps(old), encoding="utf-8")
    assert read_model(path).speeds is None


def test_the_predictions_beside_an_old_file_say_its_speeds(tmp_path):
    (tmp_path / "predictions").mkdir()
    rows = {"u": [0.4, 1.5, 9.0], "rudder": 0.1, "n": 12.0, "role": ["identify", "identify", "validate"]}
    pd.DataFrame(rows).to_parquet(tmp_path / "predictions" / "a.csv.parquet")
    assert with_operating_point(blanke(), tmp_path).speeds == (0.4, 1.5)


def test_a_ship_of_the_same_form_has_the_range_of_its_size():
    fit = blanke(speeds=(0.4, 1.5), largest_inputs={"rudder": 0.5, "n": 20.0})
    large = similar(fit, 4.0 * fit.vessel.length)
    assert large.speeds == pytest.approx((0.8, 3.0))
    assert large.largest_inputs == pytest.approx({"rudder": 0.5, "n": 10.0})
