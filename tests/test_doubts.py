"""Signals that contradict each other are called into question; those of a vessel are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ingest.log import Source
from preprocess.assembly import measurement
from preprocess.doubts import across, doubts, hardly_driven, too_far, too_little, turning_apart
from preprocess.judge import judge
from preprocess.raw import Raw
from preprocess.trial import Measurement
from preprocess.turns import with_turns
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
    return pd.DataFrame({"t": T, "psi": PSI, "u": 2.0 * np.cos(course), "v": 2.0 * np.sin(course), "r": RATE})


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


def test_the_bias_of_a_gyro_is_left_to_the_diagnosis_where_the_vessel_turns_little():
    assert turning_apart(HEADING, measured("yaw_rate", RATE + 0.3)) is None
    assert turning_apart(HEADING, measured("yaw_rate", 50.0 * RATE + 0.3)) is not None


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


def test_a_rudder_in_radians_that_are_called_degrees_is_doubted_where_the_vessel_turns_with_it():
    turning = pd.DataFrame({"t": T, "psi": 4.0 * PSI, "r": 4.0 * RATE})
    small = measured("rudder", np.radians(0.3 * np.sin(0.3 * T + 0.8)), 1e-5)
    assert "rudder never passes 0.3°, and the vessel turns by 229° with it" in too_little(small, turning)
    jitter, idle = (measured("rudder", 0.0 * T, s) for s in (1e-3, 0.0))
    usual = measured("rudder", 0.3 * np.sin(0.3 * T + 0.8))
    assert [too_little(r, turning) for r in (jitter, idle, usual)] == [None] * 3
    assert too_little(small, turning.assign(psi=0.1 * PSI, r=0.1 * RATE)) is None


@pytest.mark.parametrize(("unit", "one"), [("percent", 0.01), ("N", 1.0)])
def test_a_share_of_full_thrust_that_is_called_percent_or_newtons_is_doubted(unit, one):
    words = hardly_driven(measured("left", 0.9 * one * np.sin(0.3 * T), 1e-9), unit)
    assert words.startswith(f"left never passes 0.9 {unit}: if that is its share")
    assert hardly_driven(measured("left", 9.0 * one * np.sin(0.3 * T)), unit) is None
    assert hardly_driven(measured("left", 0.0 * T, 0.0), unit) is None
    assert hardly_driven(measured("left", 0.5 * np.sin(T)), None) is None


def test_a_track_across_the_heading_is_doubted():
    assert "north and east" in across(track(np.full(len(T), 1.4)))


def with_turns_by(gyro, step=1.0, rate=RATE, psi=PSI):
    """Headings (wrapped, every ``step`` s) with the whole turns that the yaw rate tells, and that yaw rate."""
    every = T % step < 0.05
    values = {"heading": (T[every], psi[every] % (2.0 * np.pi)), "yaw_rate": (T, gyro * rate)}
    raw = {
        k: Raw(k, t, value, np.zeros(len(t), dtype=bool), Source(k, "", {"value": k}, "rad"))
        for k, (t, value) in values.items()
    }
    turned = with_turns({k: judge(r) for k, r in raw.items()})
    return [measurement(turned[k], 1e-6) for k in ("heading", "yaw_rate")]


def test_a_yaw_rate_whose_whole_turns_the_heading_took_over_is_doubted():
    heading, gyro = with_turns_by(180.0 / np.pi)
    assert np.ptp(heading.value) > 20.0
    assert float(turning_apart(heading, gyro).split()[4]) == pytest.approx(180.0 / np.pi, rel=0.01)


def test_whole_turns_that_a_yaw_rate_tells_rightly_between_rare_headings_are_believed():
    heading, gyro = with_turns_by(1.0, 4.0, 6.0 * RATE + 0.5, 6.0 * PSI + 0.5 * T)
    assert (np.abs(np.diff(heading.value)) > np.pi).any()
    assert turning_apart(heading, gyro) is None


def test_a_heading_that_hardly_turns_beside_a_yaw_rate_that_does_is_doubted():
    radians = measured("heading", np.pi / 180.0 * PSI, 1e-5)
    assert float(turning_apart(radians, GYRO).split()[4]) == pytest.approx(180.0 / np.pi, rel=0.1)


def test_a_bias_or_the_noise_of_a_gyro_is_no_turning():
    straight = measured("heading", 0.0 * T)
    assert turning_apart(straight, measured("yaw_rate", 0.05 + 0.0 * T)) is None
    assert turning_apart(straight, measured("yaw_rate", 0.0 * T, 0.3)) is None
