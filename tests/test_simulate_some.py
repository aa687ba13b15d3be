"""Of several manoeuvres some cannot be sailed: the others are shown, and it is said which and why."""

from __future__ import annotations

import json

import pytest
from identification_samples import PROPELLER, RUDDER
from test_simulate import fit_of
from typer.testing import CliRunner

from identify.simulate import simulate
from ingest.errors import DataError, UsageError
from seatrial.cli.app import make_app
from validate.report.model_file import write_model

STABLE = {("r", "r"): -0.5, ("r", "δ"): 0.4}
#: A helm beyond some degrees is more than its cubic damping of the wrong sign bears.
WILD = {("r", "r"): -0.5, ("r", "r³"): 4.0, ("r", "δ"): 0.4}


def sailed(tmp_path, coefficients, *words):
    model = "nomoto_nonlinear" if ("r", "r³") in coefficients else "nomoto1"
    write_model(fit_of(coefficients, model, (RUDDER, PROPELLER)), tmp_path / "model.json")
    call = ["simulate", str(tmp_path / "model.json"), *words, "--speed", "1", "--samples", "0"]
    return CliRunner().invoke(make_app(), call)


def test_what_a_model_cannot_do_by_default_is_said_after_what_it_can(tmp_path):
    done = sailed(tmp_path, STABLE)
    assert done.exit_code == 0, done.output
    assert "tactical diameter" in done.stdout
    assert "Left out: stopping: the model 'nomoto1' has no surge equation." in done.stderr


def test_one_that_runs_away_does_not_discard_the_others(tmp_path):
    done = sailed(tmp_path, WILD, "--json")
    assert done.exit_code == 0, done.output
    assert "zigzag 10/10, starboard first" in [m["manoeuvre"] for m in json.loads(done.stdout)]
    assert "Left out: turning circle 35° to starboard: the model runs away" in done.stderr


@pytest.mark.parametrize("gain", [0.9, 300.0])
def test_a_run_as_fast_as_no_vessel_is_has_run_away_though_it_stays_finite(gain):
    """In a turn its thrust grows with the square of what it turns by."""
    coefficients = {
        ("u", "|u|u"): -0.1, ("u", "r²"): gain, ("u", "|n|n"): 1e-3, ("v", "v"): -1.0,
        ("r", "r"): -0.5, ("r", "δ"): 0.4,
    }  # fmt: skip
    fit = fit_of(coefficients, "blanke", (RUDDER, PROPELLER), typical_inputs={"n": 10.0})
    if gain < 1.0:
        assert simulate(fit, "circle 35")["steady_speed"].value < 3.0
    else:
        with pytest.raises(DataError, match="runs away"):
            simulate(fit, "circle 35")


def test_one_that_was_asked_for_is_an_error_after_the_others_are_shown(tmp_path):
    done = sailed(tmp_path, WILD, "circle 35", "zigzag 10/10", "stopping")
    assert isinstance(done.exception, DataError)
    assert "first overshoot" in done.stdout
    assert "turning circle 35° to starboard: the model runs away" in str(done.exception)
    assert any("stopping: the model" in note for note in done.exception.__notes__)


def test_nothing_that_can_be_sailed_is_an_error_said_once(tmp_path):
    done = sailed(tmp_path, STABLE, "--log", "nowhere.csv")
    assert isinstance(done.exception, UsageError)
    assert done.stdout == ""
    assert not getattr(done.exception, "__notes__", [])


@pytest.mark.parametrize("words", [("zigzag 10/10", "circl 35 x"), ("zigzag 10/10", "zigzag 20/0")])
def test_a_command_line_that_is_wrong_is_said_before_anything_is_sailed(tmp_path, words):
    done = sailed(tmp_path, STABLE, *words)
    assert isinstance(done.exception, UsageError)
    assert done.stdout == ""
