"""What known waves leave open in predictions is what waves do to them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identification_samples import trials_of

from identify.prepare import prepare
from identify.stretch import KIND
from identify.swell import Swell, shown_by
from validate.swell import in_swell

SWELL = Swell(1.7, 0.1, (0.05, 0.08, 0.03))


def stretch():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 3, ())
    return in_swell(prepare(trials, ship.model).identify, SWELL)[0]


def test_each_velocity_swings_by_as_much_as_said():
    here = stretch()
    answers = shown_by(here, 30.0)
    yaw = answers[here.samples.kind == KIND["yaw_rate"], 0]
    assert np.sum(yaw**2, axis=1) == pytest.approx(SWELL.motion[2] ** 2, rel=1e-2)


def test_a_heading_swings_by_the_yaw_rate_over_the_frequency():
    here = stretch()
    answers = shown_by(here, 30.0)
    heading = answers[here.samples.kind == KIND["heading"], 0]
    swing = (heading - heading.mean(axis=0)) ** 2
    assert np.mean(np.sum(swing, axis=1)) == pytest.approx((SWELL.motion[2] / SWELL.frequency) ** 2, rel=0.1)


def test_nothing_is_left_open_where_no_waves_are_known():
    assert shown_by(in_swell((stretch(),), None)[0], 30.0).shape[2] == 0


@given(st.floats(0.3, 6.0), st.floats(0.03, 0.2), st.floats(10.0, 120.0))
def test_swings_are_of_unit_variance_at_any_time(frequency, share, length):
    band = Swell(frequency, share * frequency, (1.0, 1.0, 1.0))
    waves = band.waves(np.linspace(0.0, length, 50), length)
    assert np.sum(waves**2, axis=1) == pytest.approx(1.0)
