"""The pieces of the identification while sailing: observer, information filter, sequential test."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.online_streams import sailed, vessel_for
from fixtures.effects import World
from identify.effect import Setting
from identify.online.horizon import Horizon, duration, estimate, fitted_firsts, problem_of, slid, update
from identify.online.knowledge import Knowledge, Noise, nothing_known
from identify.online.sequential import REFERENCE, Learned, monitor, score_of, threshold, watched
from identify.online.surprise import DISTURBANCE, Surprise, ahead, surprise
from identify.output_error import prior_for
from identify.stretch import Samples, Stretch
from identify.structure import structure_for
from preprocess import causal
from preprocess.causal import CausalLevels, CausalObserver, Rows
from preprocess.trial import Measurement
from preprocess.vessel import Input, Vessel

LEVELS = CausalLevels(0.05, 0.1, (0.02, 0.006, 0.003, float("nan")), (0.5, 3.0), (0.4, 0.1))
RUDDER = Input("rudder", "rudder", position=(-1.9, 0.0))
PROPELLER = Input("propeller", "propeller", position=(-1.8, 0.0))


@pytest.fixture(scope="module")
def truth():
    return sailed(vessel_for("usv", "nmea0183"), [(0.0, World())], 160.0, 8)


def rows_of(truth, seed: int, end: float = 60.0) -> Rows:
    """Positions of the antenna, headings and yaw rates at uneven times, with noise."""
    rng = np.random.default_rng(seed)
    parts = []
    for kind, rate, noise in (
        (causal.POSITION, 5.0, 0.02),
        (causal.HEADING, 10.0, 0.006),
        (causal.YAW_RATE, 10.0, 0.003),
    ):
        t = np.sort(rng.uniform(0.0, end, int(rate * end)))
        x, y, psi, r = (np.interp(t, truth.t, getattr(truth, k)) for k in ("x", "y", "psi", "r"))
        c, s = np.cos(psi), np.sin(psi)
        value = np.zeros((len(t), 2))
        if kind == causal.POSITION:
            value[:, 0], value[:, 1] = x + 0.4 * c - 0.1 * s, y + 0.4 * s + 0.1 * c
        else:
            value[:, 0] = np.mod(psi, 2 * np.pi) if kind == causal.HEADING else r
        value[:, : 1 + (kind == causal.POSITION)] += noise * rng.standard_normal(
            (len(t), 1 + (kind == causal.POSITION))
        )
        parts.append((t, np.full(len(t), kind), value))
    t, kind, value = (np.concatenate(c) for c in zip(*parts, strict=True))
    order = np.argsort(t, kind="stable")
    return Rows(t[order], kind[order].astype(np.int64), value[order])


# --- the causal observer ----------------------------------------------------------------------------------


def test_the_observer_follows_the_motion_as_surely_as_it_says(truth):
    rows = rows_of(truth, 1)
    seen = CausalObserver(LEVELS).take(rows)
    later = seen.t > 10.0
    assert seen.good[later].mean() > 0.99
    for k, name in enumerate(causal.COLUMNS):
        error = seen.state[later, k] - np.interp(seen.t[later], truth.t, getattr(truth, name))
        error -= 2 * np.pi * np.round(error / (2 * np.pi)) if name == "psi" else 0.0
        assert (
            np.sqrt(np.mean(error**2))
            < {"x": 0.06, "y": 0.06, "psi": 0.012, "u": 0.25, "v": 0.25, "r": 0.03}[name]
        )
    spread = np.sqrt(np.mean(seen.variance[later, 0]))
    error = seen.state[later, 3] - np.interp(seen.t[later], truth.t, truth.u)
    assert 0.3 < np.sqrt(np.mean(error**2)) / spread < 2.0


@given(cuts=st.lists(st.integers(1, 300), min_size=1, max_size=8))
@settings(max_examples=15, deadline=None)
def test_however_the_samples_come_the_motion_is_the_same(truth, cuts):
    rows = rows_of(truth, 2, 20.0)
    whole, parted, at, states = CausalObserver(LEVELS).take(rows), CausalObserver(LEVELS), 0, []
    for size in [*cuts, len(rows.t)]:
        part = slice(at, at + size)
        states.append(parted.take(Rows(rows.t[part], rows.kind[part], rows.value[part])).state)
        at += size
    np.testing.assert_allclose(np.concatenate(states), whole.state, rtol=0, atol=1e-12)


def test_lone_wild_samples_are_set_aside_and_a_jump_is_believed(truth):
    rows = rows_of(truth, 3, 40.0)
    value = rows.value.copy()
    position = np.flatnonzero((rows.kind == causal.POSITION) & (rows.t > 10.0))
    wild = position[::20][:6]
    value[wild] += 4.0
    seen = CausalObserver(LEVELS).take(Rows(rows.t, rows.kind, value))
    assert not seen.good[wild].any()
    assert seen.good[np.setdiff1d(position, wild)].mean() > 0.98
    jumped = value.copy()
    after = (rows.kind == causal.POSITION) & (rows.t > 25.0)
    jumped[after] += 50.0
    seen = CausalObserver(LEVELS).take(Rows(rows.t, rows.kind, jumped))
    assert seen.good[after].mean() > 0.9
    assert seen.state[-1, 0] == pytest.approx(np.interp(40.0, truth.t, truth.x) + 50.0, abs=1.0)


# --- windows of a simulated vessel ------------------------------------------------------------------------


def windows_of(truth, seed: int, size: float = 15.0, count: int = 8) -> tuple[Stretch, ...]:
    """Windows with the true states, the sensors' samples in them, and the inputs as they were given."""
    rows = rows_of(truth, seed, size * count)
    held = {
        n: Measurement(
            n, truth.t[::10], truth.inputs[::10, k], 0.0, np.ones(len(truth.t[::10]), bool), "", {}, 0.1, True
        )
        for k, n in enumerate(truth.vessel.names)
    }
    out, h = [], 0.1
    for i in range(count):
        begin, steps = size * i, round(size / h)
        grid = begin + h * np.arange(steps + 1)
        states = np.array([np.interp(grid, truth.t, getattr(truth, k)) for k in causal.COLUMNS]).T.copy()
        mine = (rows.t >= begin) & (rows.t < begin + size)
        kind, value = rows.kind[mine], rows.value[mine].copy()
        turn = kind == causal.HEADING
        near = np.interp(rows.t[mine], truth.t, truth.psi)
        value[turn, 0] += 2 * np.pi * np.round((near[turn] - value[turn, 0]) / (2 * np.pi))
        sigma = np.array([0.02, 0.006, 0.003, 1.0])[kind]
        samples = Samples(rows.t[mine], kind, value, sigma)
        spread, air = np.full((steps + 1, 3), 0.02), np.zeros((steps, 2))
        out.append(Stretch("live", "identify", begin, begin, h, steps, held, states, spread, air, samples))
    return tuple(out)


@pytest.fixture(scope="module")
def horizon(truth):
    """A horizon without windows, begun a little beside the truth."""
    vessel = Vessel("usv", truth.vessel.length, truth.vessel.beam, antenna=(0.4, 0.1))
    inputs = tuple({"rudder": RUDDER, "propeller": PROPELLER}[n] for n in truth.vessel.names)
    structure, _ = structure_for(
        "modulus", vessel, inputs, logs=("live",), streams=("position", "heading", "yaw_rate"), u0=2.0
    )
    from identify.regression import coefficient_scales, start_by_regression

    windows = windows_of(truth, 5)
    p = start_by_regression(structure, np.zeros(len(structure.slots)), windows)
    prior = prior_for(structure, coefficient_scales(structure, p, windows))
    return Horizon(structure, prior, p, Noise(np.array([0.02, 0.006, 0.003, 1.0])), nothing_known(len(p)))


@pytest.fixture(scope="module")
def known(truth, horizon):
    """The horizon with all windows, and the estimate."""
    solution = None
    for window in windows_of(truth, 5):
        horizon, solution = update(horizon, window)
    return horizon, estimate(horizon, solution)


def test_errors_are_the_noise_and_the_estimate_is_as_sure_as_it_says(truth, known):
    horizon, found = known
    problem = problem_of(horizon.windows, horizon.noise)
    first = fitted_firsts(horizon.structure, found.p, horizon.windows, horizon.noise)
    from identify.windows import moments

    cost = moments(problem, horizon.structure, found.p, first).cost
    freedom = problem.rows - 6 * len(horizon.windows) - len(found.p)
    assert cost / freedom == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / freedom))
    again = horizon
    for window in windows_of(truth, 6):
        again, solution = update(
            Horizon(
                again.structure,
                again.prior,
                again.p,
                again.noise,
                again.past,
                again.windows[-8:],
                again.first[-8:],
            ),
            window,
        )
    apart = (solution.p - found.p) / np.sqrt(np.diag(found.covariance))
    assert np.sqrt(np.mean(apart**2)) < 2.0


def test_what_has_left_the_horizon_counts_as_much(truth, horizon, known):
    short = horizon
    for window in windows_of(truth, 5):
        short, solution = update(slid(short, 3), window)
    assert len(short.windows) == 4
    _, found = known
    sd = np.sqrt(np.diag(found.covariance))
    assert np.abs((short.p - found.p) / sd).max() < 0.7
    np.testing.assert_allclose(np.sqrt(np.diag(estimate(short, solution).covariance)), sd, rtol=0.15)


def test_old_windows_are_forgotten(truth, horizon):
    from dataclasses import replace

    short = replace(horizon, forget=20.0)
    for window in windows_of(truth, 5):
        short, solution = update(slid(short, 3), window)
    some = np.sqrt(np.diag(estimate(short, solution).covariance))
    whole = replace(horizon)
    for window in windows_of(truth, 5):
        whole, solution = update(whole, window)
    assert np.median(some / np.sqrt(np.diag(estimate(whole, solution).covariance))) > 1.5


def test_knowledge_fades_by_time():
    known = Knowledge(np.eye(2), np.ones(2), np.eye(2), at=10.0)
    later = known.later(30.0, 20.0)
    np.testing.assert_allclose(later.information, np.eye(2) * np.exp(-1.0))
    assert later.at == 30.0
    np.testing.assert_allclose(known.later(30.0, np.inf).vector, known.vector)


# --- the monitor ------------------------------------------------------------------------------------------


def test_a_block_that_the_model_fits_is_no_surprise_and_a_push_is(truth, known):
    horizon, found = known
    blocks = windows_of(truth, 7, 10.0, 14)
    told = [surprise(horizon.structure, found, b, horizon.noise) for b in blocks]
    size = np.array([s.size / s.freedom for s in told])
    slow = np.array([s.slow / s.slow_freedom for s in told])
    assert size.mean() == pytest.approx(1.0, abs=0.15)
    assert slow.mean() == pytest.approx(1.0, abs=1.0)
    pushed = sailed(truth.vessel, [(0.0, World())], 160.0, 8)
    object.__setattr__(pushed, "x", pushed.x + 0.5 * 0.05 * np.mod(pushed.t, 10.0) ** 2)
    worse = [surprise(horizon.structure, found, b, horizon.noise) for b in windows_of(pushed, 7, 10.0, 4)]
    assert min(s.size / s.freedom for s in worse) > 1.5
    assert min(s.slow for s in worse) > 50.0
    m = monitor(1.0 / 36_000.0, 10.0)
    assert all(score_of(m, s) > 4.0 for s in worse)
    assert duration(blocks[0]) == pytest.approx(10.0)


def test_a_disturbance_adds_one_constant_to_each_equation(horizon):
    setting: Setting = horizon.structure.setting
    assert {t.dof: t.text for t in DISTURBANCE.terms(setting, None).values()} == {
        "u": "1",
        "v": "1",
        "r": "1",
    }


def test_ten_seconds_ahead_of_the_truth_is_where_it_went(truth, known):
    horizon, found = known
    (block,) = windows_of(truth, 7, 10.0, 1)
    error = ahead(horizon.structure, found.p, block, 0, block.steps)
    assert np.hypot(*error[:2]) < 0.1
    assert np.abs(error[2:]).max() < 0.05


@pytest.mark.parametrize("run_length", [50.0, 500.0])
def test_the_threshold_keeps_its_rate_of_false_alarms(run_length):
    limit, rng = threshold(run_length), np.random.default_rng(4)
    total, alarms, steps = np.zeros(400), 0, 4000
    for _ in range(steps):
        total = np.maximum(total + rng.standard_normal(400) - REFERENCE, 0.0)
        crossed = total > limit
        alarms += int(crossed.sum())
        total[crossed] = 0.0
    assert 400 * steps / alarms == pytest.approx(run_length, rel=0.15)


def test_scores_of_blocks_that_fit_are_normal_and_alarms_are_rare():
    rng, m = np.random.default_rng(5), monitor(1.0 / 36_000.0, 10.0)
    scores, alarms = [], 0
    for k in range(7200):
        block = Surprise(
            5.0 * k, 5.0 * k + 10.0, rng.chisquare(290), 290.0, rng.chisquare(3), 3.0, np.zeros(3)
        )
        m = watched(m, block, k % 2)
        scores.append(m.score)
        alarms += m.alarm
    assert np.mean(scores) == pytest.approx(0.0, abs=0.06)
    assert np.std(scores) == pytest.approx(1.0, abs=0.06)
    assert alarms <= 4


def test_a_change_is_noticed_and_its_beginning_is_known():
    rng, m = np.random.default_rng(6), monitor(1.0 / 36_000.0, 10.0)
    for k in range(100):
        shift = 1.25 if k >= 90 else 1.0
        block = Surprise(
            5.0 * k, 5.0 * k + 10.0, shift * rng.chisquare(290), 290.0, rng.chisquare(3), 3.0, np.zeros(3)
        )
        m = watched(m, block, k % 2)
        if m.alarm:
            break
    assert 90 <= k <= 96
    assert 440.0 <= m.changed_at <= 470.0


def test_what_is_wider_than_theory_is_learned():
    rng, learned = np.random.default_rng(8), Learned()
    for _ in range(300):
        learned = learned.after(1.3 * rng.chisquare(20) / 20, 2.0 / 20)
    assert learned.mean == pytest.approx(1.3, abs=0.12)
    assert learned.upper(1.3 * 20 * 1.9, 20.0) < 0.02 < learned.upper(1.3 * 20, 20.0)
