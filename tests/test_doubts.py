"""Signals that contradict each other are called into question; those of a vessel are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from preprocess.doubts import across, doubts, too_far, turning_apart
from preprocess.trial import Measurement
from preprocess.vessel import Input

T = np.arange(0.0, 120.0, 0.1)
RATE = 0.15 * np.sin(0.3 * T)
PSI = -0.5 * np.cos(0.3 * T)


def measured(name, value, sigma=0.005):
    noise = np.random.default_rng(3).normal(0.0, sigma, len(T))
    return Measurement(name, T, value + noise, sigma, np.ones(len(T), dtype=bool))


HEADING, GYRO, RUDDER = measured("heading", PSI), measured("yaw_rate", RATE), measured("rudder", 0.3 * RATE)


def track(course):
    """Motion at 2 m/s along a course beside the heading."""
    return pd.DataFrame({"t": T, "u": 2.0 * np.cos(course), "v": 2.0 * np.sin(course)})


def test_signals_of_a_vessel_are_not_doubted():
    declared = [Input("rudder", "rudder")]
    assert (
        doubts({"heading": HEADING, "yaw_rate": GYRO}, {"rudder": RUDDER}, declared, track(0.2 * RATE)) == []
    )
    astern = pd.DataFrame({"t": T, "u": -2.0 + 0.0 * T, "v": 0.1 * RATE})
    assert across(astern) is None


@pytest.mark.parametrize("factor", [180.0 / np.pi, -1.0, np.pi / 180.0])
def test_a_yaw_rate_of_another_unit_or_sign_is_doubted(factor):
    words = turning_apart(HEADING, measured("yaw_rate", factor * RATE, 1e-4))
    assert float(words.split()[4]) == pytest.approx(factor, rel=0.01)


def test_a_gyro_whose_scale_is_off_is_left_to_the_diagnosis():
    assert turning_apart(HEADING, measured("yaw_rate", 1.3 * RATE)) is None


def test_a_signal_that_is_no_yaw_rate_is_doubted():
    assert "do not go together" in turning_apart(HEADING, measured("yaw_rate", 0.2 * np.cos(0.71 * T)))


def test_a_vessel_that_hardly_turns_tells_nothing():
    straight = measured("heading", 0.0 * T)
    assert turning_apart(straight, measured("yaw_rate", 0.0 * T)) is None


def test_few_samples_tell_nothing():
    few = replace(GYRO, good=T < 0.3)
    assert turning_apart(HEADING, few) is None


def test_a_rudder_in_degrees_that_are_called_radians_is_doubted():
    assert "rudder reaches 1146°" in too_far(measured("rudder", 20.0 * np.sin(0.3 * T), 1e-6))
    assert too_far(RUDDER) is None


def test_a_track_across_the_heading_is_doubted():
    assert "north and east" in across(track(np.full(len(T), 1.4)))
