"""Noise of what drives a model: off an actuator's feedback, which a slack linkage would follow, and off the wind."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.actuator_dynamics import play
from ingest.log import Source
from preprocess.commands import feedback_noise, judge_input
from preprocess.feedback import without_noise
from preprocess.gusts import without_noise as without_gust_noise
from preprocess.raw import Raw

RATE, STEP = 0.3, 0.1
T = np.arange(0.0, 240.0, STEP)


def moved(orders):
    """Where an actuator is that follows orders (n,) at its own rate, rad."""
    at, out = orders[0], np.empty(len(orders))
    for i, order in enumerate(orders):
        at += np.clip(order - at, -RATE * STEP, RATE * STEP)
        out[i] = at
    return out


def zigzag():
    return moved(np.where(T // 12.0 % 2.0 == 0.0, 0.26, -0.26))


def joystick(seed=0):
    return moved(np.repeat(np.random.default_rng(seed).uniform(-0.4, 0.4, len(T) // 30), 30))


def slack(angle, width):
    return play(angle, np.zeros(len(angle)), width, 0.0, np.empty(0))[0]


def wide(angle, width):
    """The slack (rad) by which the movement of an angle comes nearest to a true one behind a width."""
    widths = np.linspace(0.6, 1.6, 101) * width
    true = slack(TRUE, width)
    off = [np.var(slack(angle, w) - true) for w in widths]
    return widths[int(np.argmin(off))]


TRUE = zigzag()


def test_slack_seems_wider_by_the_noise_of_feedback_and_not_without_it():
    noisy = TRUE + np.random.default_rng(1).normal(0.0, 0.0018, len(T))
    lines = without_noise(T, noisy, feedback_noise(noisy))
    assert wide(noisy, 0.04) > 1.05 * 0.04
    assert wide(lines, 0.04) == pytest.approx(0.04, rel=0.025)


@pytest.mark.parametrize("angle", [zigzag(), joystick(), 0.3 * np.sin(0.4 * T), np.full(len(T), 0.1)])
def test_lines_are_nearer_to_the_angle_than_its_samples(angle):
    noisy = angle + np.random.default_rng(2).normal(0.0, 0.002, len(T))
    lines = without_noise(T, noisy, 0.002)
    assert np.sqrt(np.mean((lines - angle) ** 2)) < 0.75 * 0.002


@given(st.integers(0, 1000), st.floats(1e-4, 0.1), st.floats(0.0, 0.9))
@settings(max_examples=25, deadline=None)
def test_no_value_is_moved_by_more_than_its_noise_on_average_whatever_the_times(seed, sigma, lost):
    rng = np.random.default_rng(seed)
    keep = np.sort(rng.choice(len(T), max(10, int((1.0 - lost) * 400)), replace=False))
    noisy = (joystick(seed) + rng.normal(0.0, sigma, len(T)))[keep]
    lines = without_noise(T[keep], noisy, sigma)
    assert np.sqrt(np.mean((lines - noisy) ** 2)) <= sigma * (1.0 + 1e-9)


def raw_of(value, ordered=False):
    source = Source("rudder", "rudder", {"value": "value"}, "rad")
    return Raw("rudder", T, value, np.zeros(len(T), dtype=bool), source, ordered=ordered)


def test_feedback_alone_is_freed_of_its_noise():
    """Orders are what was sent; steps that hold, and what only rounding moves, stay too."""
    noisy = TRUE + np.random.default_rng(3).normal(0.0, 0.002, len(T))
    assert not np.array_equal(judge_input(raw_of(noisy)).value, noisy)
    rounded, held = np.round(TRUE, 2), np.where(T // 12.0 % 2.0 == 0.0, 0.26, -0.26)
    for value, ordered in ((noisy, True), (rounded, False), (held, False)):
        np.testing.assert_array_equal(judge_input(raw_of(value, ordered)).value, value)


def blown(seed, gusts, lasting, every):
    rng, t = np.random.default_rng(seed), np.arange(0.0, 600.0, every)
    kept, air = np.exp(-every / lasting), np.zeros((len(t), 2))
    for i in range(1, len(t)):
        air[i] = kept * air[i - 1] + gusts * np.sqrt(1.0 - kept**2) * rng.standard_normal(2)
    return t, air + np.array([5.0, -3.0])


@pytest.mark.parametrize(("gusts", "lasting", "every"), [(1.0, 8.0, 1.0), (0.7, 20.0, 0.5), (1.0, 3.0, 0.2)])
def test_wind_is_nearer_to_the_air_than_the_anemometer(gusts, lasting, every):
    t, air = blown(1, gusts, lasting, every)
    measured = air + np.random.default_rng(2).normal(0.0, 0.5, air.shape)
    smoothed, noise = without_gust_noise(t, measured)
    assert noise == pytest.approx(0.5, rel=0.15)
    assert np.sqrt(np.mean((smoothed - air) ** 2)) < 0.75 * 0.5


def test_a_steady_wind_is_its_mean_and_one_without_noise_stays():
    t = np.arange(0.0, 600.0)
    steady = np.tile([5.0, -3.0], (len(t), 1))
    smoothed, noise = without_gust_noise(t, steady + np.random.default_rng(3).normal(0.0, 0.4, steady.shape))
    assert noise == pytest.approx(0.4, rel=0.1)
    assert np.abs(smoothed - steady).max() < 0.1
    t, air = blown(4, 1.0, 8.0, 1.0)
    assert np.sqrt(np.mean((without_gust_noise(t, air)[0] - air) ** 2)) < 0.05
    assert without_gust_noise(t[:5], air[:5])[1] == 0.0


@given(st.integers(0, 1000), st.floats(1e-9, 1e-3))
@settings(max_examples=15, deadline=None)
def test_samples_that_come_all_but_at_once_are_no_trouble(seed, apart):
    rng = np.random.default_rng(seed)
    t = np.sort(np.concatenate([T[:400], T[rng.choice(400, 60, replace=False)] + apart]))
    noisy = np.interp(t, T, TRUE) + rng.normal(0.0, 0.002, len(t))
    assert np.isfinite(without_noise(t, noisy, 0.002)).all()
    smoothed, noise = without_gust_noise(t, np.column_stack([noisy, noisy[::-1]]))
    assert np.isfinite(smoothed).all()
    assert noise > 0.0
