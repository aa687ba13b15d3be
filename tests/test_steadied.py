"""A fit at the noise in windows whose values drive it over whole logs has values that do not, if windows allow them."""

from __future__ import annotations

from dataclasses import replace

import pytest
from identification_samples import trials_of

from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch
from identify.fitted import NEAR
from identify.free_running import free_running_misfit, is_lost
from identify.prepare import prepare
from identify.whole_windows import steadied

#: A receiver that hardly tells the sway of a small vessel.
COARSE = replace(
    Suite(),
    position=Sensor(1.0, 1.0, 0.0),
    heading=Sensor(5.0, 0.01, 0.0),
    yaw_rate=Sensor(5.0, 0.01, 0.0),
)


@pytest.fixture(scope="module")
def lost():
    ship, trials = trials_of("tug", ("zigzag", "zigzag10"), 60.0, 6, validate=0, suite=COARSE)
    ready = prepare(trials, ship.model)
    return fit_from_scratch(ready.structure, ready.identify, length=10.0, rounds=0)


def test_values_that_windows_leave_open_are_those_that_whole_logs_are_followed_with(lost):
    """A quadratic damping was found of a ship, and taken back: its sway, which no window told, ran away."""
    assert lost.chi2_per_dof < NEAR
    assert free_running_misfit(lost) > 10.0
    steady = steadied(lost)
    assert free_running_misfit(steady) < 0.5
    assert steady.problem is lost.problem
    assert steady.solution.total < lost.solution.total + 40.0
    assert steadied(steady) is steady


@pytest.mark.parametrize(
    ("name", "value"),
    [("NEAR", 0.5), ("BY_CHANCE", 0.9999)],
    ids=["far from the noise", "windows against it"],
)
def test_a_fit_far_from_the_noise_or_whose_windows_lose_by_it_stays_as_it_was(lost, name, value, monkeypatch):
    assert is_lost(lost)
    monkeypatch.setattr(f"identify.whole_windows.{name}", value)
    assert steadied(lost) is lost
