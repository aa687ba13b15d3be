"""Measured accelerations: less gravity, used where they foretell the motion, left where they do not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from preprocess_samples import BIAS, Imperfect, body_acceleration, sampled, tilt, truth_of

from ingest.log import Log
from preprocess.accelerations import find_accelerations, level
from preprocess.inertial import every_other
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials

SENSORS = {
    "position": Imperfect(5.0, 0.02, 0.2, 0.1),
    "heading": Imperfect(10.0, 0.01, 0.2),
    "yaw_rate": Imperfect(20.0, 0.003),
    "IMU": Imperfect(50.0, 0.05),
}
ARM = (0.4, -0.2)


@pytest.fixture(scope="module")
def made():
    return sampled(truth_of("catamaran", "random", 60.0), **SENSORS)


def trial_of(made, tables=None, **vessel):
    log = replace(made.log, tables=made.log.tables if tables is None else tables)
    run = LoggedRun("a", log, "identify", manoeuvre="random")
    return make_trials([run], replace(made.vessel, **vessel), made.inputs, made.sensors, by_response=False)[0]


def errors(trial, truth):
    s = trial.states
    inside = (s["t"] > 3.0) & (s["t"] < 58.0)
    return np.array(
        [np.std((s[k] - np.interp(s["t"], truth.t, getattr(truth, k)))[inside]) for k in ("u", "v")]
    )


def said(trial):
    """What the history says of the accelerations; None where there are none."""
    return next((s.arguments for s in trial.history if s.action == "accelerations"), None)


def without(tables, *names):
    return {k: t for k, t in tables.items() if k not in names}


def test_accelerations_halve_the_error_of_an_agile_boat(made):
    plain = trial_of(made, without(made.log.tables, "IMU", "ATT"))
    better = trial_of(made)
    assert said(plain) is None
    assert (errors(better, made.truth) < 0.55 * errors(plain, made.truth)).all()
    assert said(better)["used"]
    assert said(better)["bias"] == pytest.approx(BIAS, abs=0.02)
    assert said(better)["sigma"] == pytest.approx(0.05 / np.sqrt(5.0), rel=0.4)
    assert any("are used" in f for f in better.findings)
    s = better.states.dropna()
    inside = s[(s["t"] > 3.0) & (s["t"] < 58.0)]
    share = (inside["u"] - np.interp(inside["t"], made.truth.t, made.truth.u)) / inside["sigma_u"]
    assert 0.6 < np.sqrt(np.mean(share**2)) < 1.6


def test_gravity_is_taken_off_by_roll_and_pitch(made):
    found = find_accelerations(made.log)
    true = np.column_stack(body_acceleration(made.truth, found.t))
    assert not found.upright
    assert np.std(found.value - BIAS - true, axis=0) == pytest.approx([0.05, 0.05], rel=0.1)
    upright = find_accelerations(replace(made.log, tables=without(made.log.tables, "ATT")))
    assert upright.upright
    assert np.std(upright.value - true) > 0.2


def test_what_a_rolling_sensor_shows_without_roll_is_left(made):
    plain = trial_of(made, without(made.log.tables, "IMU", "ATT"))
    wild = made.log.tables["IMU"].copy()
    t = wild.index.to_numpy() * 1e-9
    wild["AccX"] += 4.0 * np.sin(0.5 * t)
    wild["AccY"] += 4.0 * np.cos(0.4 * t)
    trial = trial_of(made, {**without(made.log.tables, "ATT"), "IMU": wild})
    assert not said(trial)["used"]
    assert any("not used" in f and "upright" in f for f in trial.findings)
    pd.testing.assert_frame_equal(trial.states, plain.states)


def test_the_sensors_place_is_taken_off(made):
    """Accelerations of a point away from the origin: known where it is, nothing is lost."""
    r, dr = made.truth.r, np.gradient(made.truth.r, made.truth.t)
    moved = made.log.tables["IMU"].copy()
    t = moved.index.to_numpy() * 1e-9
    forward, starboard = -dr * ARM[1] - r**2 * ARM[0], dr * ARM[0] - r**2 * ARM[1]
    moved["AccX"] += np.interp(t, made.truth.t, forward)
    moved["AccY"] += np.interp(t, made.truth.t, starboard)
    tables = {**made.log.tables, "IMU": moved}
    known, wrong = (errors(trial_of(made, tables, imu=arm), made.truth) for arm in (ARM, (-0.8, 0.4)))
    assert (known < 0.7 * wrong).all()
    assert known == pytest.approx(errors(trial_of(made), made.truth), rel=0.3)


def test_columns_that_are_there_for_the_formats_sake_are_none(made):
    blank = made.log.tables["IMU"].assign(AccX=0.0, AccY=0.0)
    assert find_accelerations(replace(made.log, tables={**made.log.tables, "IMU": blank})) is None
    assert find_accelerations(replace(made.log, tables={})) is None


def test_a_level_sensor_at_rest_shows_nothing():
    roll, pitch = np.array([0.3, -0.2]), np.array([0.1, 0.4])
    gravity = 9.81 * np.column_stack(
        [np.sin(pitch), -np.cos(pitch) * np.sin(roll), -np.cos(pitch) * np.cos(roll)]
    )
    np.testing.assert_allclose(level(gravity, roll, pitch), 0.0, atol=1e-12)


def test_ros_axes_and_quaternions_are_turned():
    """Forward, port, up beside forward, starboard, down: the same boat."""
    t = np.arange(0.0, 20.0, 0.02)
    roll, pitch = tilt(t)
    g, stamps = 9.81, pd.Index(np.round(t * 1e9).astype("int64"), name="t_ns")
    x, y, z = g * np.sin(pitch), -g * np.cos(pitch) * np.sin(roll), -g * np.cos(pitch) * np.cos(roll)
    x = x + 0.3 * np.cos(pitch) * np.sin(t)  # a push forward, level
    z = z - 0.0 * t
    half = roll / 2.0, -pitch / 2.0  # the bow goes down with a positive pitch in these axes
    w = np.cos(half[0]) * np.cos(half[1])
    q = (
        w,
        np.sin(half[0]) * np.cos(half[1]),
        np.cos(half[0]) * np.sin(half[1]),
        -np.sin(half[0]) * np.sin(half[1]),
    )
    columns = {f"linear_acceleration.{k}": v for k, v in zip("xyz", (x, -y, -z), strict=True)}
    columns |= {f"orientation.{k}": v for k, v in zip("wxyz", q, strict=True)}
    found = find_accelerations(Log(Path("a.mcap"), "mcap", {"/imu": pd.DataFrame(columns, index=stamps)}))
    assert not found.upright
    np.testing.assert_allclose(found.value[:, 0], 0.3 * np.sin(t), atol=2e-3)
    np.testing.assert_allclose(found.value[:, 1], 0.0, atol=2e-3)


def test_positions_are_held_back_in_runs(made):
    from preprocess.chains import Stream

    good = np.ones(40, bool)
    good[3] = False
    aside = every_other(Stream("position", np.arange(40.0), np.zeros((40, 2)), 0, good, good))
    assert not aside[:9].any()
    assert aside[9:17].all()
    assert aside.sum() == 16
