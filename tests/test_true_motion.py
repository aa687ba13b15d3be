"""What sensors would show of a motion, and the motion behind what they show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import MOTORS
from test_effects import with_effect
from test_kernel import FIRST, STEPS, stretch_of

from identify.drive import drive
from identify.effect import Variant
from identify.predict import free_run, run, shown, true_first_state
from identify.sensor_line import SensorLine, sensor_line
from identify.true_motion import true_states


def test_the_first_true_state_is_what_would_be_shown():
    cases = {
        "heading_bias": {"bias": 0.1},
        "current": {"north": 0.3, "east": 0.1},
        "gyro_bias": {"bias": 0.01, "scale": 1.1},
    }
    for name, values in cases.items():
        structure, p, _, _ = with_effect(name, values)
        stretch = stretch_of(MOTORS)
        seen = np.array([2.0, -1.0, 0.5, 0.9, 0.05, 0.1])
        d = drive(structure, p, stretch)
        ready = replace(stretch, states=np.tile(seen, (STEPS + 1, 1)))
        start = true_first_state(structure, d, ready)
        assert shown(structure, d, ready, run(structure, d, ready, start))[0] == pytest.approx(seen)
        assert free_run(structure, p, ready)[0] == pytest.approx(seen)


@pytest.mark.parametrize(
    ("name", "values", "options"),
    [
        ("heading_bias", {"bias": 0.3}, {}),
        ("antenna_offset", {"x": 0.7, "y": -0.4}, {}),
        ("clock_offset", {"offset": 0.35}, {"stream": "position"}),
        ("clock_offset", {"offset": -0.2}, {"stream": "yaw_rate"}),
        ("clock_offset", {"offset": 0.5}, {"stream": "heading"}),
    ],
)
def test_the_true_motion_is_what_the_sensors_would_show(name, values, options):
    structure, p, _, _ = with_effect(name, values, Variant(options=options))
    stretch = stretch_of(MOTORS)
    d = drive(structure, p, stretch)
    motion = run(structure, d, stretch, FIRST)
    seen = shown(structure, d, replace(stretch, states=motion[:, :6]), motion)
    found = true_states(structure, d.sensor, replace(stretch, states=seen))
    inside = slice(10, -10)  # what is late at the ends was not shown
    shift, left = (np.abs(x - motion[:, :6])[inside].max() for x in (seen, found))
    assert shift > 1e-3
    assert left < 0.1 * shift


@pytest.mark.parametrize("one", [True, False])
def test_the_velocity_of_a_late_receiver_is_late_too(one):
    structure, p, _, _ = with_effect(
        "clock_offset", {"offset": 0.35}, Variant(options={"stream": "position"})
    )
    structure = replace(structure, setting=replace(structure.setting, one_receiver=one))
    d = drive(structure, p, stretch_of(MOTORS))
    assert d.sensor[5:9] == pytest.approx([0.35, 0.0, 0.0, 0.35 if one else 0.0])


@pytest.mark.parametrize("late", [0.0, 0.6, -0.35, 0.03, -0.045])
def test_a_gyro_is_as_late_as_what_it_said_and_a_smoothed_rate_that_followed_it_is_not(late):
    grid = 0.1 * np.arange(801)
    rate = 0.2 * np.sin(0.4 * grid) + 0.1 * np.sin(1.1 * grid + 0.5)
    t = np.arange(1.0, 79.0, 0.05)
    sigma = np.full(len(t), 0.01)
    noise = sigma * np.random.default_rng(3).standard_normal(len(t))
    true = 0.2 * np.sin(0.4 * (t - late)) + 0.1 * np.sin(1.1 * (t - late) + 0.5)
    found = sensor_line(t, 1.05 * true + 0.02 + noise, sigma, grid, rate)
    assert found.late == pytest.approx(late, abs=0.01)
    assert found.slope == pytest.approx(1.05, abs=0.01)
    assert found.offset == pytest.approx(0.02, abs=0.002)


def test_a_late_gyro_shows_only_where_the_smoother_followed_it():
    structure, p, _, _ = with_effect("clock_offset", {"offset": 0.6}, Variant(options={"stream": "yaw_rate"}))
    stretch = stretch_of(MOTORS)
    d = drive(structure, p, stretch)
    for late in (0.0, 0.6):
        vars(stretch)["gyro_line"] = SensorLine(late=late)
        motion = run(structure, d, stretch, FIRST)
        seen = shown(structure, d, stretch, motion)
        moved = np.abs(seen[:, 5] - motion[:, 5]).max()
        assert (moved > 0.01) if late == 0.0 else (moved < 1e-12)


def test_a_late_compass_shows_only_where_the_smoother_followed_it_and_moves_the_antenna_that_it_turns():
    structure, p, _, _ = with_effect("clock_offset", {"offset": 0.5}, Variant(options={"stream": "heading"}))
    structure = replace(structure, vessel=replace(structure.vessel, antenna=(0.6, 0.2)))
    stretch = stretch_of(MOTORS)
    d = drive(structure, p, stretch)
    motion = run(structure, d, stretch, FIRST)
    for followed in (True, False):
        vars(stretch)["compass_line"] = SensorLine(late=0.0 if followed else 0.5)
        vars(stretch)["gyro_line"] = SensorLine(late=-0.5 if followed else 0.0)
        seen = shown(structure, d, stretch, motion)
        moved = np.abs(seen - motion[:, :6]).max(axis=0)
        assert (moved[[0, 2, 5]] > 1e-3).all() if followed else (moved < 1e-9).all()
        shown_stretch = replace(stretch, states=seen)
        vars(shown_stretch).update(compass_line=stretch.compass_line, gyro_line=stretch.gyro_line)
        found = true_states(structure, d.sensor, shown_stretch)
        assert np.abs(found - motion[:, :6])[10:-10].max() < 0.02 * max(moved.max(), 1e-6)


def test_a_late_receiver_shows_where_the_vessel_was_before_the_first_sample_too():
    structure, p, _, _ = with_effect(
        "clock_offset", {"offset": 0.35}, Variant(options={"stream": "position"})
    )
    stretch = stretch_of(MOTORS)
    d = drive(structure, p, stretch)
    motion = run(structure, d, stretch, FIRST)
    seen = shown(structure, d, stretch, motion)
    speed = np.hypot(*(motion[1, :2] - motion[0, :2])) / stretch.h
    assert np.hypot(*(seen[0, :2] - motion[0, :2])) == pytest.approx(0.35 * speed, rel=1e-6)
