"""Offsets beside a whole hull: unbiased to what the samples allow, and not claimed where the hull cannot follow."""

from dataclasses import replace

import numpy as np
import pytest
from preprocess_samples import Imperfect, sampled, truth_of

from preprocess.hull_data import acting, forces, motion_at, seen, windows_of
from preprocess.hull_fit import MORE, Problem, cut_windows, left_by
from preprocess.hull_run import BEYOND, STATE, free_terms, sail
from preprocess.hull_start import first_guess
from preprocess.response_clock import by_hull, moving_inputs, response_time
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials


def trial_of(vessel, manoeuvre, seed, delay):
    made = sampled(
        truth_of(vessel, manoeuvre, 120.0, seed),
        seed,
        position=Imperfect(5.0, 0.02, delay=delay),
        heading=Imperfect(10.0, 0.01),
        yaw_rate=Imperfect(20.0, 0.003),
    )
    return make_trials([LoggedRun("a", made.log, "identify")], made.vessel, made.inputs, made.sensors)[0]


def streams_of(trial):
    from preprocess.chains import Stream

    order = {"position": 0, "heading": 0, "yaw_rate": 1}
    return [
        Stream(k, m.t, m.value.reshape(len(m.t), -1), order[k], m.good, m.good, m.sigma)
        for k, m in trial.measurements.items()
    ]


@pytest.fixture(scope="module")
def late():
    return trial_of("patrol", "random", 3, 0.2)


def test_a_positions_offset_is_known_to_a_fiftieth_of_a_second(late):
    (step,) = [s for s in late.history if s.action == "clock_offsets"]
    _, offset, stderr, _ = step.arguments["position"]
    assert offset == pytest.approx(0.2, abs=0.02)
    assert stderr < 0.015
    assert abs(offset - 0.2) < 3.0 * stderr
    assert any("stamps of position" in f for f in late.findings)


def test_sensitivities_are_those_of_the_run(late):
    rng = np.random.default_rng(0)
    inputs = [acting(m) for m in moving_inputs(late.inputs)]
    edges = 20.0 + 0.1 * np.arange(41)
    here, later = forces(inputs, edges)
    equation, term = free_terms(len(inputs))
    theta = np.zeros((3, 15 + 4 * len(inputs)))
    theta[equation, term] = 0.02 * rng.standard_normal(len(term))
    first, current = np.array([1.0, 2.0, 0.3, 1.5, 0.1, -0.2]), np.array([0.2, -0.1])
    _, slopes = sail(theta, first, current, here, later, 0.1)
    small, p = 1e-6, len(term)
    for k in (0, 3, 9, p - 1):
        moved = theta.copy()
        moved[equation[k], term[k]] += small
        back = 2.0 * theta - moved
        ends = [sail(x, first, current, here, later, 0.1)[0][-1] for x in (moved, back)]
        np.testing.assert_allclose(
            (ends[0] - ends[1]) / (2.0 * small), slopes[-1, :, k], rtol=1e-5, atol=1e-8
        )
    for k in range(STATE):
        push = small * np.eye(STATE)[k]
        ends = [sail(theta, first + x, current, here, later, 0.1)[0][-1] for x in (push, -push)]
        found = slopes[-1, :, p + BEYOND + k]
        np.testing.assert_allclose((ends[0] - ends[1]) / (2.0 * small), found, rtol=1e-5, atol=1e-8)
    ends = [sail(theta, first, current, here + x * later, later, 0.1)[0][-1] for x in (small, -small)]
    np.testing.assert_allclose((ends[0] - ends[1]) / (2.0 * small), slopes[-1, :, p], rtol=1e-4, atol=1e-7)


def test_errors_and_their_slopes_agree(late):
    """Of the offsets and of the sensors' errors, which the run itself knows nothing of."""
    states, streams = late.states.dropna(), streams_of(late)
    sensors = [seen(s, states, late.segments, 0.1) for s in streams]
    windows = cut_windows(windows_of(((20.0, 40.0),), 10.0), 0.1, sensors, 0.2)
    inputs = [acting(m) for m in moving_inputs(late.inputs)]
    problem = Problem(windows, inputs, np.ones(3), np.empty(0))
    guess, problem = first_guess(problem, states, (0.0, 0.2), np.array([0.1, -0.05]), 1e-4)
    guess = replace(guess, mounting=np.array([0.3, -0.2, 0.05]))
    p = len(problem.prior)
    left, small = left_by(problem, guess), 1e-5
    for k in range(p + BEYOND, p + BEYOND + MORE):
        step = np.zeros(p + BEYOND + MORE + STATE * len(windows))
        step[k] = small
        ends = [left_by(problem, guess.moved(x)).errors[0] for x in (step, -step)]
        slope = (ends[1] - ends[0]) / (2.0 * small)
        assert np.abs(slope).max() > 0.0
        np.testing.assert_allclose(slope, left.slopes[0][:, k], rtol=1e-3, atol=1e-3 * np.abs(slope).max())


def test_a_hull_that_cannot_follow_says_nothing(late):
    """The track swings as no hull does: what was found before stays."""
    states = late.states.dropna()
    streams = streams_of(late)
    swing = 3.0 * np.sin(1.7 * streams[0].t)[:, None]
    odd = [replace(streams[0], value=streams[0].value + swing), *streams[1:]]
    pairs = [(0.05, 0.3), (0.1, 0.3)]
    time, none = response_time(late.states), np.zeros(2)
    assert by_hull(states, late.segments, moving_inputs(late.inputs), odd, time, pairs, none) == (
        pairs,
        False,
    )
    told, clean = by_hull(states, late.segments, moving_inputs(late.inputs), streams, time, pairs, none)
    assert clean
    assert told[1][0] == pytest.approx(0.2, abs=0.02)


def test_the_smoothed_motion_moves_with_its_positions_stamps(late):
    states = late.states.dropna()
    t = np.array([30.0, 50.0])
    here, moved = (motion_at(states, t, off, np.zeros(2), np.zeros(3)) for off in (0.0, 0.2))
    np.testing.assert_allclose(here[:, 3], np.interp(t, states["t"], states["u"]))
    np.testing.assert_allclose(moved[:, 0], np.interp(t + 0.2, states["t"], states["x"]))
    speed = [
        np.hypot(m[:, 3], m[:, 4]) for m in (motion_at(states, t + 0.2, 0.0, np.zeros(2), np.zeros(3)), moved)
    ]
    np.testing.assert_allclose(*speed, rtol=2e-3)
