"""The reason for the program: what is missing is found, what is not there is not, what is unknown is owned up to."""

from __future__ import annotations

import pytest

from fixtures.campaign import DEFAULT_SUITE, FORMATS, record_campaign, write_campaign
from fixtures.draw import make_effect
from fixtures.effects import Effect, World
from fixtures.outside import OUTSIDE
from fixtures.vessels import make_vessel
from seatrial.campaign import load_campaign
from seatrial.pipeline import run
from validate.diagnosis import Verdict

MANOEUVRES = ("zigzag", "random", "zigzag")


def diagnose(folder, vessel, effects, log_format, seed, manoeuvres=MANOEUVRES):
    ship = make_vessel(vessel)
    runs = record_campaign(
        ship,
        World(tuple(effects)),
        FORMATS[log_format].suite(DEFAULT_SUITE),
        manoeuvres,
        duration=56,
        seed=seed,
    )
    path = write_campaign(folder, ship, runs, log_format)
    return run(load_campaign(path))


@pytest.mark.slow
@pytest.mark.parametrize(("vessel", "log_format"), [("usv", "mcap"), ("catamaran", "tlog")])
def test_a_campaign_that_lacks_nothing_is_adequate(tmp_path, vessel, log_format):
    found = diagnose(tmp_path, vessel, [], log_format, 41)
    assert found.diagnosis.verdict is Verdict.ADEQUATE
    assert found.after.effects == ()
    assert found.validation_after.channels["r"].r2 > 0.95


@pytest.mark.slow
def test_a_current_is_found_with_its_speed_and_direction(tmp_path):
    world = [Effect("current", {"speed": 0.2, "direction": 1.0})]
    found = diagnose(tmp_path, "catamaran", world, "dataflash", 42)
    assert found.diagnosis.verdict is Verdict.EXPLAINED
    [effect] = found.diagnosis.effects
    assert effect.fitted.name == "current"
    values = {p.name: p for p in effect.fitted.parameters}
    assert values["speed"].value == pytest.approx(0.2, abs=0.01)
    assert values["direction"].value == pytest.approx(1.0, abs=0.05)
    # Not positions: inputs logged ten times a second leave a free-running heading a random walk of its own.
    before, after = found.validation_before.channels, found.validation_after.channels
    assert all(after[c].rmse < 0.5 * before[c].rmse for c in "uvr")
    alone = run(load_campaign(tmp_path), loop=False).validation_before.channels
    assert all(before[c].rmse == pytest.approx(alone[c].rmse, rel=1e-3) for c in "uvr"), "looked for or not"


@pytest.mark.slow
def test_exchanged_thrusters_are_found_before_anything_else(tmp_path):
    world = [Effect("input_wiring", {}, options={"swapped": ("left", "right")})]
    found = diagnose(tmp_path, "catamaran", world, "csv", 43)
    [effect] = found.diagnosis.effects
    assert effect.fitted.name == "input_wiring"
    assert effect.fitted.options["swapped"] == ["left", "right"]


@pytest.mark.slow
def test_a_lag_of_the_rudder_is_told_from_a_delay(tmp_path):
    found = diagnose(
        tmp_path, "usv", [Effect("actuator_lag", {"time_constant": 1.0}, input="rudder")], "candump", 44
    )
    assert found.diagnosis.verdict is Verdict.EXPLAINED
    [effect] = found.diagnosis.effects
    assert (effect.fitted.name, effect.fitted.input) == ("actuator_lag", "rudder")
    assert effect.fitted.parameters[0].value == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_a_tether_that_no_library_knows_is_owned_up_to(tmp_path):
    tether = make_effect("tether", OUTSIDE["tether"].sizes(make_vessel("usv"))[1], make_vessel("usv"), 31)
    found = diagnose(tmp_path, "usv", [tether], "csv", 31, ("zigzag", "circle", "random", "zigzag"))
    assert found.diagnosis.verdict is Verdict.UNEXPLAINED
    assert max(found.diagnosis.unexplained.values()) > 0.10


@pytest.mark.slow
def test_a_gyro_that_reads_too_little_is_named_and_does_not_spoil_the_prediction(tmp_path):
    found = diagnose(tmp_path, "usv", [Effect("gyro_bias", {"bias": 0.03, "scale": 0.8})], "csv", 45)
    assert found.diagnosis.verdict is Verdict.EXPLAINED
    [effect] = found.diagnosis.effects
    assert effect.fitted.name == "gyro_bias"
    assert {p.name: p.value for p in effect.fitted.parameters} == pytest.approx(
        {"bias": 0.03, "scale": 0.8}, abs=0.002
    )
    assert found.validation_after.channels["r"].r2 > 0.98
