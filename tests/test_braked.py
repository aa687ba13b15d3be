"""No reported fit is driven by its own resistance, unless it would leave the noise without."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch
from identify.braked import braked
from identify.prepare import prepare
from identify.term import Term, brakes
from validate import verdict


def test_the_highest_odd_power_of_its_own_motion_slows_a_vessel():
    terms = [
        *(Term("u", t) for t in ("u", "u|u|", "u³", "vr", "|n|u")),
        *(Term("v", t) for t in ("v", "|v|v", "|v|r", "uv", "r")),
        *(Term("r", t) for t in ("r", "v", "ur")),
    ]
    assert {t.name for t in brakes(terms)} == {"X_u3", "Y_|v|v"}  # a ship may be unstable on its course


#: Sensors too coarse to say what of a sway's damping is linear.
COARSE = replace(
    Suite(),
    position=Sensor(2.0, 1.0, 0.0),
    heading=Sensor(10.0, 0.1, 0.0),
    yaw_rate=Sensor(10.0, 0.05, 0.0),
)


@pytest.fixture(scope="module")
def driven():
    """A fit that sways of itself beyond the speeds that it was fitted to, and where that coefficient is."""
    ship, trials = trials_of("usv", ("zigzag", "zigzag10"), 60.0, 6, validate=0, suite=COARSE)
    prepared = prepare(trials, ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=15.0, rounds=0)
    [k] = [k for k, s in enumerate(fitted.solution.structure.slots) if s.name == "Y_v|v|"]
    assert fitted.solution.p[k] > 0.5
    return fitted, k


def test_what_the_logs_leave_open_does_not_drive(driven):
    fitted, k = driven
    slowed = braked(fitted)
    assert slowed.solution.p[k] == 0.0
    assert slowed.solution.held[k]
    assert slowed.solution.total < fitted.solution.total + 10.0
    assert braked(slowed) is slowed


def test_what_the_logs_insist_on_stays(driven):
    fitted, k = driven
    here = np.arange(len(fitted.solution.p)) == k
    told = replace(fitted, prior=fitted.prior.holding(fitted.solution.p, here))
    assert braked(told) is told


@pytest.mark.parametrize(("off", "said"), [(True, {"u": 3.2}), (False, {})])
def test_a_fit_off_the_noise_that_runs_away_from_its_own_logs_leaves_what_they_are_off_by(
    monkeypatch, off, said
):
    """Over windows a rich model follows weed on its propeller by coefficients with which it then runs away."""
    structure = SimpleNamespace(model=SimpleNamespace(predicts=("u", "v")))
    prepared = SimpleNamespace(identify=("log",), validate=(), structure=structure)
    monkeypatch.setattr(verdict, "spread_of", lambda _: np.ones(3))
    monkeypatch.setattr(verdict, "over_whole_logs", lambda *_: {"u": 3.2, "v": 0.9, "r": 3.0})
    assert verdict._left_astray(prepared, SimpleNamespace(is_off=off)) == said
