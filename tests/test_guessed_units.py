"""A signal without a stated unit is read alike in all logs of a campaign."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from ingest import read_log
from preprocess.guessed_units import with_common_units
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials
from preprocess.vessel import Input, Vessel

VESSEL = Vessel("ship", 60.0, 9.0)


def logged(folder, name, inputs):
    """A delimited log of a slow ship that sails along and turns, with columns that state no units."""
    t = np.arange(0.0, 60.0, 0.1)
    r = 1.5 * np.sin(0.1 * t)
    psi = np.cumsum(r) * 0.1
    speed, heading = 5.0, np.radians(psi)
    x, y = (np.cumsum(speed * f(heading)) * 0.1 for f in (np.cos, np.sin))
    table = pd.DataFrame({"time": t, "x": x, "y": y, "heading": psi % 360.0, "r": r, **inputs(t)})
    table.to_csv(folder / name, index=False)
    return LoggedRun(name, read_log(folder / name), "identify")


def test_a_thrust_a_little_over_one_is_no_percent(tmp_path):
    """One log reaches 1.003; the other stays below."""
    runs = [logged(tmp_path, f"{most}.csv", lambda t, m=most: {"n": m * np.sin(t)}) for most in (0.7, 1.003)]
    trials = make_trials(runs, VESSEL, [Input("n", "thruster", "n")], {})
    assert [float(np.abs(t.inputs["n"].value).max()) for t in trials] == pytest.approx([0.7, 1.003], rel=0.01)


def test_a_rudder_that_hardly_moves_in_one_log_is_in_degrees_there_too(tmp_path):
    """Thirty degrees in one log, one in the other."""
    runs = [
        logged(tmp_path, f"{most}.csv", lambda t, m=most: {"delta": m * np.sin(t)}) for most in (30.0, 1.0)
    ]
    trials = make_trials(runs, VESSEL, [Input("delta", "rudder", "delta")], {})
    most = [float(np.abs(t.inputs["delta"].value).max()) for t in trials]
    assert most == pytest.approx(np.radians([30.0, 1.0]), rel=0.01)


def test_an_azimuth_that_goes_round_is_in_radians(tmp_path):
    """Up to three radians, without a unit."""
    runs = [logged(tmp_path, "a.csv", lambda t: {"alpha": 3.0 * np.sin(t)})]
    trials = make_trials(runs, VESSEL, [Input("alpha", "azimuth", "alpha")], {})
    assert float(np.abs(trials[0].inputs["alpha"].value).max()) == pytest.approx(3.0, rel=0.01)


@pytest.mark.parametrize("factor", [1.0, np.degrees(1.0)])
def test_a_slow_ship_says_by_its_heading_what_its_yaw_rate_is_in(tmp_path, factor):
    """At most one and a half: degrees, or radians, as the number goes."""
    run = logged(tmp_path, "a.csv", lambda t: {"n": np.sin(t)})
    table = run.log.tables[""]
    table["r"] *= factor / np.degrees(1.0)
    trial = make_trials([run], VESSEL, [Input("n", "thruster", "n")], {})[0]
    r = trial.measurements["yaw_rate"].value
    assert float(np.abs(r).max()) == pytest.approx(np.radians(1.5), rel=0.05)


def test_what_the_track_says_of_a_heading_in_one_log_holds_in_a_log_without_motion(tmp_path):
    """Radians that go on counting beyond one turn: alone they look like degrees."""
    t = np.arange(0.0, 60.0, 0.1)
    runs = []
    for name, moves in (("a", 1.0), ("b", 0.0)):
        psi = 0.3 * t * moves + 14.0
        x, y = (np.cumsum(f(psi)) * moves for f in (np.cos, np.sin))
        path = tmp_path / f"{name}.csv"
        pd.DataFrame({"time": t, "x": x + 1.0, "y": y, "heading": psi}).to_csv(path, index=False)
        runs.append(LoggedRun(path.name, read_log(path), "identify"))
    found = [next(s.unit for s in r.log.sources if s.quantity == "heading") for r in runs]
    assert found == ["rad", "deg"]
    common = with_common_units(runs, VESSEL)
    assert {s.unit for r in common for s in r.log.sources if s.quantity == "heading"} == {"rad"}
