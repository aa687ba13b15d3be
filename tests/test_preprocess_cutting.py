"""A long log becomes one trial per manoeuvre; a short one, or one that the campaign names, stays whole."""

import numpy as np
import pytest
from preprocess_samples import Imperfect, sampled

from fixtures.dynamics import HOLD, OPEN, ZIGZAG
from fixtures.manoeuvres import Leg, Manoeuvre
from fixtures.simulator import simulate
from fixtures.vessels import make_vessel
from identify.stretch import stretches_of
from preprocess.cutting import circle_borders, straight_runs, turning_points
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials

#: Idle, straight, zigzag 20/20, straight, circle, straight, idle: when each begins, s.
LEGS = (
    Leg(0.0, OPEN, 0.0),
    Leg(120.0, HOLD, 1.0, 0.5),
    Leg(270.0, ZIGZAG, 1.0, 20.0 / 35.0, np.radians(20.0)),
    Leg(470.0, HOLD, 1.0, 0.5),
    Leg(620.0, OPEN, 1.0, 0.6),
    Leg(800.0, OPEN, 1.0, 0.0),
    Leg(1000.0, OPEN, 0.0),
)
KINDS = ["idle", "straight", "zigzag", "straight", "circle", "straight", "idle"]
SENSORS = {
    "position": Imperfect(2.0, 0.02),
    "heading": Imperfect(4.0, 0.01),
    "yaw_rate": Imperfect(4.0, 0.003),
}


@pytest.fixture(scope="module")
def afternoon():
    ship = make_vessel("usv")
    truth = simulate(ship, Manoeuvre("random", LEGS, 1300.0, 10.0), seed=1, heading=0.4)
    return sampled(truth, 1, **SENSORS)


def trials_of(made, role="identify", **declared):
    run = LoggedRun("afternoon.csv", made.log, role, **declared)
    return make_trials([run], made.vessel, made.inputs, made.sensors, by_response=False)


@pytest.fixture(scope="module")
def cut(afternoon):
    return trials_of(afternoon)


def test_every_manoeuvre_becomes_a_trial(cut):
    kinds = [t.manoeuvre for t in cut]
    sailed = [k for k, before in zip(kinds, [None, *kinds], strict=False) if k != before]
    assert sailed[0] == sailed[-1] == "idle"
    assert [k for k in sailed if k in ("zigzag", "circle")] == ["zigzag", "circle"]
    for kind, leg in (("zigzag", LEGS[2]), ("circle", LEGS[4])):
        (part,) = [t for t in cut if t.manoeuvre == kind]
        assert part.segments[0][0] == pytest.approx(leg.start, abs=30.0)
    assert {t.name for t in cut} == {"afternoon.csv"}
    assert len(cut) <= len(KINDS) + 1


def test_nothing_is_fitted_to_a_vessel_that_lies_idle(cut):
    idle = [t for t in cut if t.manoeuvre == "idle"]
    assert len(idle) == 2
    for t in idle:
        assert t.segments == ()
        assert not stretches_of(t, 0.1)
        assert np.hypot(t.states["u"], t.states["v"]).median() < 0.1
    fitted = [s for t in cut for s in stretches_of(t, 0.1)]
    assert min(s.grid[0] for s in fitted) == pytest.approx(120.0, abs=15.0)


def test_every_sample_and_every_row_is_in_one_part(cut, afternoon):
    run = LoggedRun("afternoon.csv", afternoon.log, "identify", manoeuvre="random")
    (whole,) = make_trials([run], afternoon.vessel, afternoon.inputs, afternoon.sensors, by_response=False)
    np.testing.assert_array_equal(np.concatenate([t.states["t"] for t in cut]), whole.states["t"])
    for name, m in whole.measurements.items():
        np.testing.assert_array_equal(np.concatenate([t.measurements[name].t for t in cut]), m.t)
        assert {t.measurements[name].sigma for t in cut} == {m.sigma}
    for t in cut:
        assert len(t.inputs["a0"].t) == len(whole.inputs["a0"].t)
        assert t.history[-1].action == "cut"


def test_what_the_campaign_names_or_slices_stays_whole(afternoon):
    assert len(trials_of(afternoon, manoeuvre="random")) == 1
    (sliced,) = trials_of(afternoon, slice=(260.0, 480.0))
    assert sliced.manoeuvre == "zigzag"


def test_both_roles_of_a_divided_log_are_cut(afternoon):
    roles = [t.role for t in trials_of(afternoon, role=None)]
    assert roles == sorted(roles)
    assert set(roles) == {"identify", "validate"}
    assert len(roles) > 3


def test_borders_by_hand():
    t = np.arange(0.0, 400.0)
    psi = np.interp(t, [0.0, 100.0, 200.0, 230.0, 260.0, 400.0], [0.0, 0.0, 7.0, 6.5, 7.0, 7.0])
    assert turning_points(psi, 0.1) == [200, 230]
    assert circle_borders(t, psi) == [0.0, 200.0]
    straight = straight_runs(t, psi, 40.0)
    assert straight[:100].all()
    assert straight[270:].all()
    assert not straight[110:190].any()
