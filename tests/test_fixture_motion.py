"""The truth simulator: velocities at a receiver's antenna, and effects' forces on a vessel that is heavier."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fixtures.campaign import DEFAULT_SUITE
from fixtures.effects import Effect, World
from fixtures.forces import WorldNumbers, derivative
from fixtures.manoeuvres import make_manoeuvre
from fixtures.sensors import Sensor, sense
from fixtures.simulator import simulate
from fixtures.vessels import actuator_table, make_vessel


def test_a_velocity_between_two_samples_is_that_of_the_antenna():
    """Where a format holds both in one message; a hull that turns moves its antenna otherwise than its origin."""
    vessel = make_vessel("usv")
    truth = simulate(
        vessel,
        make_manoeuvre("random", vessel, 60.0, 1),
        World((Effect("antenna_offset", {"x": 0.6, "y": -0.5}),)),
        1,
    )
    silent = dataclasses.replace(DEFAULT_SUITE.position, noise=0.0, outliers=0.0)
    suite = dataclasses.replace(DEFAULT_SUITE, position=silent, velocity=Sensor(5.0, 0.0), antenna=(0.4, 0.1))
    recording = sense(truth, suite, 3)
    t = recording.streams["position"].t
    north, east = recording.velocity_at_fixes()
    psi, u, v, r = (np.interp(t, truth.t, getattr(truth, c)) for c in ("psi", "u", "v", "r"))
    u, v = u - r * (0.1 - 0.5), v + r * (0.4 + 0.6)
    inside = (t > 0.1) & (t < truth.t[-1] - 0.1)
    assert north[inside] == pytest.approx((u * np.cos(psi) - v * np.sin(psi))[inside], abs=2e-3)
    assert east[inside] == pytest.approx((u * np.sin(psi) + v * np.cos(psi))[inside], abs=2e-3)


@pytest.mark.parametrize("effect", ["walk_r", "bias_v", "damp_r", "turn_dd", "loss", "wind_cy", "roll_yaw"])
def test_a_heavier_vessel_answers_less_to_what_an_effect_adds(effect):
    vessel = make_vessel("usv")
    table, azimuth_of = actuator_table(vessel)
    state = np.array([0.0, 0.0, 0.4, 2.0, 0.2, 0.3, 0.1, 0.0, 2.0, 0.2, 0.3])

    def rates(**world):
        out = np.zeros(11)
        derivative(
            vessel.hull, WorldNumbers(wind=1.0, **world), 0.0, state, table, azimuth_of, np.array([0.2, 20.0]),
            np.ones(2), np.array([3.0, -1.0]), np.zeros(3), np.zeros(2), out,
        )  # fmt: skip
        return out[3:6]

    more = rates(**{effect: 0.1}) - rates()
    less = rates(**{effect: 0.1}, mass_ratio=1.25) - rates(mass_ratio=1.25)
    assert np.abs(more).max() > 0.0
    assert less == pytest.approx(more / 1.25, abs=1e-12)
