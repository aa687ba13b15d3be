"""What an actuator makes of its command: lag, rate, slack, dead band, offset; on any grid the same."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from identify.actuator_dynamics import deadband_neutral, displaced, first_order, play, rate_limited
from identify.stretch import before
from preprocess.trial import Measurement

STEP_AT = 0.3041  # s, within a step of 12.5 ms
FINELY = 2e-5
NOTHING = np.empty(0)  # was told before
NONE = NOTHING, NOTHING


def test_a_lag_is_first_order():
    command = np.repeat(np.random.default_rng(0).uniform(-1, 1, 8), 40)
    out, _ = first_order(command, np.zeros(len(command)), 0.01, 0.3, *NONE)
    keep = math.exp(-0.01 / 0.3)
    ends = lfilter([1 - keep], [1, -keep], command - command[0]) + command[0]  # exact at the end of each step
    begins = np.concatenate([[command[0]], ends[:-1]])
    exact = command + (begins - command) * 0.3 / 0.01 * (1 - keep)  # mean over the step
    assert np.allclose(out, exact, atol=1e-12)
    assert np.allclose(first_order(command, np.zeros(len(command)), 0.01, 0.0, *NONE)[0], command, atol=1e-15)


@pytest.mark.parametrize("lag", [1e-6, 1e-3, 5e-3, 0.05])
def test_a_lag_through_zero_has_the_mean_thrust_of_its_path(lag):
    """However fast: a command that jumps within no step is followed at once as its lag goes to nothing."""
    dt, before, after = 0.0125, -0.5, 0.7
    command = np.array([before, after, after])
    mean, more = first_order(command, np.zeros(3), dt, lag, *NONE)
    edges = np.linspace(0.0, 1.0, 400_001) ** 3 * dt  # finely where it is fast
    path = after + (before - after) * np.exp(-edges / lag)
    thrust = np.trapezoid(path * np.abs(path), edges) / dt
    assert mean[1] * abs(mean[1]) + more[1] == pytest.approx(thrust, abs=1e-6)


def test_a_rate_limit_bounds_the_rate():
    command = np.concatenate([np.zeros(20), np.ones(200), -np.ones(300)])
    out, _ = rate_limited(command, np.zeros(len(command)), 0.01, 0.8, *NONE)
    assert np.abs(np.diff(out)).max() <= 1.5 * 0.8 * 0.01 + 1e-12  # means over steps, the last one a part
    assert np.interp(0.5, out[20:220], np.arange(200) * 0.01) == pytest.approx(0.5 / 0.8, abs=0.01)
    assert out[-1] == pytest.approx(-1.0)
    assert np.allclose(rate_limited(command, np.zeros(len(command)), 0.01, 1e9, *NONE)[0], command, atol=1e-8)


def test_play_follows_within_its_half_width():
    command = 0.3 * np.sin(np.linspace(0, 12, 600))
    out, _ = play(command, np.zeros(len(command)), 0.1, 0.0, NOTHING)
    assert np.abs(out - command).max() <= 0.1 + 1e-12
    moving_up = np.diff(out) > 1e-9
    assert np.allclose((command - out)[1:][moving_up], 0.1)
    assert np.ptp(out) == pytest.approx(0.6 - 0.2, abs=1e-3)


@pytest.mark.parametrize("shifted", [False, True])
def test_a_neutral_band_gives_nothing_near_zero(shifted):
    command = np.linspace(-1, 1, 41)
    out, _ = deadband_neutral(command, np.zeros(len(command)), 0.2, shifted)
    inside = np.abs(command) <= 0.2
    assert not out[inside].any()
    assert np.allclose(out[~inside], (command - 0.2 * np.sign(command) * shifted)[~inside])


@pytest.mark.parametrize("begin", [-1.0, 0.5])
def test_play_begins_where_it_is_told_until_the_slack_is_taken_up(begin):
    command = np.concatenate([np.zeros(50), np.full(50, 0.5)])
    out, _ = play(command, np.zeros(len(command)), 0.1, begin, NOTHING)
    assert np.allclose(out[:50], 0.1 * begin)
    assert np.allclose(out[51:], 0.4)


@pytest.mark.parametrize(
    "actuator",
    [
        lambda c, b: play(*c, 0.13, 0.5, b.told),
        lambda c, b: first_order(*c, 1.0, 1.7, b.told, b.lasted),
        lambda c, b: rate_limited(*c, 1.0, 0.31, b.told, b.lasted),
    ],
)
@given(
    told=st.lists(st.sampled_from(np.linspace(-1.0, 1.0, 21)), min_size=2, max_size=40),
    cut=st.integers(min_value=1, max_value=38),
)
def test_an_actuator_remembers_what_it_was_told_before_a_stretch(actuator, told, cut):
    """Begun midway with what the log says of before, it is where it is if followed from the log's begin."""
    values = np.array(told)
    cut, t = min(cut, len(values) - 1), np.arange(len(values), dtype=float)
    logged = Measurement("rudder", t, values, 0.0, t >= 0.0, held=True)
    earlier = before(logged, float(cut))
    whole, _ = actuator((values, 0.0 * values), before(logged, -1.0))
    rest, _ = actuator((values[cut:], 0.0 * values[cut:]), earlier)
    assert np.allclose(rest, whole[cut:], atol=1e-12)
    assert sum(earlier.lasted) == pytest.approx(cut)


def means(series, dt=0.0125, every=FINELY):
    """Means over steps of a finely given series, and what the means of its square with sign are more than theirs."""
    n = round(dt / every)
    parts = series[: len(series) // n * n].reshape(-1, n)
    mean = parts.mean(axis=1)
    return mean, (parts * np.abs(parts)).mean(axis=1) - mean * np.abs(mean)


@pytest.mark.parametrize(
    ("coarse", "fine"),
    [
        (
            lambda c: first_order(*c, 0.0125, 0.21, *NONE),
            lambda c: first_order(c, 0.0 * c, FINELY, 0.21, *NONE),
        ),
        (
            lambda c: rate_limited(*c, 0.0125, 7.0, *NONE),
            lambda c: rate_limited(c, 0.0 * c, FINELY, 7.0, *NONE),
        ),
        (lambda c: play(*c, 0.3, 0.2, NOTHING), lambda c: play(c, 0.0 * c, 0.3, 0.2, NOTHING)),
        (lambda c: deadband_neutral(*c, 0.3, True), lambda c: deadband_neutral(c, 0.0 * c, 0.3, True)),
        (lambda c: displaced(*c, -0.4), lambda c: displaced(c, 0.0 * c, -0.4)),
    ],
)
def test_an_actuator_follows_a_command_from_the_moment_at_which_it_changes(coarse, fine):
    """On a grid of 12.5 ms a command that switches within a step does what it does on one of 20 µs: mean and thrust."""
    t = FINELY * np.arange(round(1.25 / FINELY))
    command = np.select([t < STEP_AT, t < 2.3 * STEP_AT, t < 2.9 * STEP_AT], [-0.6, 1.1, 0.2], -0.8)
    mean, surge = coarse(means(command))
    exact, more = means(fine(command)[0])
    assert np.allclose(mean, exact, atol=2e-3)  # 0.02 before: an impulse of a step's tenth
    assert np.allclose(surge, more, atol=3e-3)
    assert abs((mean - exact).sum()) < 0.004
