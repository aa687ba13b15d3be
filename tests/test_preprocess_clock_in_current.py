"""Clocks of position and inputs beside a current, an antenna elsewhere, a turned compass: none is taken for one."""

from dataclasses import replace

import numpy as np
import pytest
from preprocess_samples import Imperfect, sampled

from fixtures.effects import Effect, World
from fixtures.manoeuvres import make_manoeuvre
from fixtures.simulator import simulate
from fixtures.vessels import make_vessel
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials

#: A current, by speed and direction; far slower than the vessel.
CURRENT = {"speed": 0.375, "direction": 0.0}


def clocks_of(
    world=(), late=0.0, antenna=(0.0, 0.0), turned=0.0, gyro=True, heading=0.0, vessel="patrol", kind="zigzag"
):
    """Offsets by stream, and what is said, of one log; a zigzag is at one speed of the propeller."""
    ship = make_vessel(vessel)
    manoeuvre = make_manoeuvre(kind, ship, 100.0, 0)
    if kind == "zigzag":
        manoeuvre = replace(manoeuvre, legs=tuple(replace(x, throttle=1.0) for x in manoeuvre.legs))
    truth = simulate(ship, manoeuvre, World(world), heading=heading)
    sensors = {"position": Imperfect(5.0, 0.02, delay=late), "heading": Imperfect(10.0, 0.01)}
    sensors |= {"yaw_rate": Imperfect(20.0, 0.003)} if gyro else {}
    made = sampled(truth, 0, antenna=antenna, **sensors)
    tables = made.log.tables
    tables["heading"] = np.mod(tables["heading"] + turned, 2.0 * np.pi)
    made = replace(made, vessel=replace(made.vessel, antenna=(0.0, 0.0)))
    (trial,) = make_trials([LoggedRun("a", made.log, "identify")], made.vessel, made.inputs, made.sensors)
    (step,) = [s for s in trial.history if s.action == "clock_offsets"]
    return step.arguments, [f for f in trial.findings if "stamps" in f]


@pytest.mark.parametrize(
    "case",
    [
        {"world": (Effect("current", CURRENT),)},
        {"world": (Effect("current", {"speed": 0.35, "direction": 2.06}),), "heading": 3.4, "gyro": False},
        {"antenna": (1.0, 0.3)},
        {"turned": 0.07},
    ],
    ids=["current", "current without a gyro", "antenna", "compass"],
)
def test_what_is_no_clock_is_said_to_be_none(case):
    told, said = clocks_of(**case)
    assert said == []
    for _, offset, stderr, _ in told.values():
        assert abs(offset) < 3.0 * stderr


@pytest.mark.parametrize(
    "case",
    [
        {},
        {
            "vessel": "catamaran",
            "kind": "random",
            "world": (Effect("current", {"speed": 0.2, "direction": 1.0}),),
        },
    ],
    ids=["calm", "current"],
)
def test_a_position_that_is_late_is_found_in_a_current_too(case):
    told, said = clocks_of(**case, late=0.4)
    _, offset, stderr, _ = told["position"]
    assert abs(offset - 0.4) < 3.0 * stderr
    assert [f.split(" are ")[0] for f in said] == ["The stamps of position"]
