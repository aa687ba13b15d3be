"""Where positions wander, so that sway is hardly seen, a fit still finds the right one of many valleys."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fixtures.campaign import DEFAULT_SUITE, FORMATS, record_campaign, write_campaign
from fixtures.effects import World
from fixtures.sensors import Sensor
from fixtures.vessels import make_vessel
from identify import base_fit
from identify.base_fit import fit_from_scratch, fit_one_way, window_length
from identify.loosened import loosened
from identify.prepare import prepare
from identify.structure import null_parameters
from preprocess.trials import make_trials
from seatrial.campaign import load_campaign
from seatrial.pipeline import read_logs, runs_of
from validate.refits import under

MANOEUVRES = ("zigzag", "circle", "random", "speed")


def prepared(folder, vessel, receiver, seed):
    ship = make_vessel(vessel)
    suite = FORMATS["csv"].suite(replace(DEFAULT_SUITE, position=receiver))
    runs = record_campaign(ship, World(), suite, MANOEUVRES, duration=120.0, seed=seed, validate=0)
    campaign = load_campaign(write_campaign(folder, ship, runs, "csv"))
    sensors = {s.quantity: s for s in campaign.sensors}
    # as where a diagnosis follows, which asks of clocks itself
    trials = make_trials(
        runs_of(campaign, read_logs(campaign)), campaign.vessel, campaign.inputs, sensors, by_response=False
    )
    return prepare(trials, ship.model)


@pytest.mark.slow
def test_a_compass_is_followed_though_no_start_from_the_smoothed_motion_leads_there(tmp_path, monkeypatch):
    receiver = Sensor(1.0, 0.02, 0.004, wander=0.6, wander_time=20.0, lost=0.01)
    found = prepared(tmp_path, "cybership", receiver, 109)
    begun = fit_one_way(found.structure, found.identify, length=window_length(found.structure.vessel.length))
    assert fit_from_scratch(found.structure, found.identify, begun=begun).slow < 1.1
    monkeypatch.setattr(base_fit, "SLOWLY", np.inf)  # not begun a third time
    monkeypatch.setattr(base_fit, "NEAR", np.inf)
    assert fit_from_scratch(found.structure, found.identify, begun=begun).slow > 1.2


def test_coefficients_that_are_let_go_in_steps_end_where_those_of_a_good_start_do(tmp_path):
    found = prepared(tmp_path, "usv", Sensor(5.0, 0.02, 0.004), 3)
    straight = fit_from_scratch(found.structure, found.identify)
    steps = loosened(found.structure, found.identify, null_parameters(found.structure), 30.0)
    assert under(straight.problem, steps).solution.total == pytest.approx(straight.solution.total, abs=1.0)
