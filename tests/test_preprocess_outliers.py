"""Outliers, repeats, flags: found where they are, and nothing taken for one that is not."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from preprocess_samples import Imperfect, sampled, truth_of

from preprocess.judge import repeated, robust_unwrap
from preprocess.outliers import local_residual, robust_three_sigma, sliding_three_sigma
from preprocess.rounding import resolution
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials


def test_the_papers_rule_by_hand():
    x = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 100.0])
    # median 3.5, absolute deviations 2.5 1.5 .5 .5 1.5 96.5: MAD 1.5, limit 3 · 1.4826 · 1.5 = 6.67
    np.testing.assert_array_equal(robust_three_sigma(x), [False] * 5 + [True])


def test_constant_values_are_no_outliers():
    assert not robust_three_sigma(np.full(20, 3.0)).any()


def test_local_fit_leaves_nothing_of_a_parabola_at_uneven_times():
    t = np.sort(np.random.default_rng(0).uniform(0.0, 10.0, 200))
    assert np.abs(local_residual(t, 1.0 + 2.0 * t - 0.3 * t**2)).max() < 1e-6


def hard_manoeuvre():
    """A yaw rate that steps between extremes and rests between: extremes that the plain rule discards."""
    t = np.arange(0.0, 120.0, 0.1)
    r = 0.4 * np.tanh(3.0 * np.sin(0.25 * t)) * (np.sin(0.05 * t) > 0.6)
    rng = np.random.default_rng(1)
    return t, r + rng.normal(0.0, 0.003, len(t)), rng


def test_sliding_rule_keeps_genuine_extremes_where_the_plain_rule_discards_them():
    t, r, rng = hard_manoeuvre()
    bad = rng.random(len(t)) < 0.05
    x = r + bad * 0.003 * rng.uniform(8.0, 30.0, len(t)) * rng.choice([-1.0, 1.0], len(t))
    plain, sliding = robust_three_sigma(x), sliding_three_sigma(t, x, k=4.5)
    assert plain[~bad].mean() > 0.1
    assert sliding[~bad].mean() < 0.01
    assert sliding[bad].mean() > 0.95


@pytest.mark.parametrize(
    ("vessel", "manoeuvre"), [("usv", "zigzag"), ("tanker", "random"), ("catamaran", "random")]
)
def test_recall_and_false_alarms_of_the_default(vessel, manoeuvre):
    found, bad, false, good = 0, 0, 0, 0
    for seed in range(2):
        sensors = {
            "position": Imperfect(5.0, 0.02, lost=0.1, outliers=0.05),
            "heading": Imperfect(10.0, 0.01, outliers=0.05),
            "yaw_rate": Imperfect(20.0, 0.003, outliers=0.05),
        }
        made = sampled(truth_of(vessel, manoeuvre, 120.0, seed), seed, **sensors)
        (trial,) = make_trials(
            [LoggedRun("a.csv", made.log, "identify")],
            made.vessel,
            made.inputs,
            made.sensors,
            by_response=False,
        )
        for name in sensors:
            aside, wild = ~trial.measurements[name].good, made.bad[name]
            found, bad = found + int(aside[wild].sum()), bad + int(wild.sum())
            false, good = false + int(aside[~wild].sum()), good + int((~wild).sum())
    assert found / bad >= 0.98
    assert false / good <= 0.004


def test_reasons_are_counted():
    made = sampled(
        truth_of("usv", "zigzag", 60.0),
        position=Imperfect(5.0, 0.02, outliers=0.05),
        heading=Imperfect(10, 0.01),
    )
    (trial,) = make_trials(
        [LoggedRun("a.csv", made.log, "identify")], made.vessel, made.inputs, made.sensors, by_response=False
    )
    m = trial.measurements["position"]
    assert m.reasons["outlier"] == int((~m.good).sum()) > 0


def test_repeats_between_fixes_are_not_new_measurements():
    fixes = np.cumsum(np.random.default_rng(0).normal(1.0, 0.1, (50, 2)), axis=0)
    logged = np.repeat(fixes, 4, axis=0)
    marked = repeated(logged, 0.0)
    assert marked.sum() == 150
    assert not marked[::4].any()


def test_a_vessel_at_rest_repeats_itself_rightly():
    quantum = 0.011
    steps = np.random.default_rng(0).choice([0, 0, 0, 0, 1, -1], (200, 2))
    assert not repeated(np.cumsum(steps, axis=0) * quantum, quantum).any()


@pytest.mark.parametrize("steps", [0.7, 1.0, 3.0, 8.0])
def test_a_noisy_compass_that_rounds_repeats_itself_by_chance(steps):
    """A steady ship with a compass of 0.1 degrees once lost a tenth of its headings as not measured anew."""
    random = np.random.default_rng(4)
    course = 0.3 * np.sin(np.arange(2000) / 60.0) * steps
    measured = np.rint(course + random.normal(0.0, steps, 2000)) * 0.1
    assert not repeated(measured, 0.1).any()
    twice = np.repeat(measured, 2)
    assert repeated(twice, 0.1).mean() > (0.4 if steps >= 3.0 else 0.01)


@given(st.floats(1e-4, 10.0), st.integers(0, 1_000_000))
@settings(max_examples=100, deadline=None)
@example(step=1.0, seed=983)  # large changes are within a fiftieth of a whole number whatever they are
def test_rounding_is_found(step, seed):
    x = np.random.default_rng(seed).normal(0.0, 5.0, 500)
    assert resolution(np.round(x) * step) == pytest.approx(step, rel=1e-6)
    assert resolution(x * step) == 0.0


@given(st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_an_outlier_adds_no_turn_to_the_heading(seed):
    rng = np.random.default_rng(seed)
    psi = np.cumsum(rng.normal(0.1, 0.05, 300))
    logged = np.mod(psi, 2.0 * np.pi)
    bad = rng.choice(290, 8, replace=False)
    logged[bad] += rng.uniform(-3.0, 3.0, 8)
    out = robust_unwrap(logged)
    keep = np.setdiff1d(np.arange(300), bad)
    turns = (out - psi)[keep] / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns[0]), atol=1e-9)
