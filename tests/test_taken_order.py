"""Samples stand in the windows in which they were taken, and no window predicts what nobody can."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identification_samples import trials_of

from fixtures.effects import Effect
from identify import taken_order
from identify.base_fit import fit_from_scratch
from identify.drift import Drift
from identify.innovations import new_in
from identify.kernel import HEADING, YAW_RATE
from identify.parameter_covariance import covariance_of
from identify.prepare import prepare
from identify.stretch import Samples
from identify.taken_order import as_in, by_clocks, in_order_taken
from identify.windows import BEFORE, SHARE_BEFORE, cut
from validate.at_its_best import settled
from validate.candidates import candidates

LATE = 0.49


def prepared_with(effects=(), vessel="raft", seed=5):
    ship, trials = trials_of(vessel, ("zigzag", "random", "zigzag"), 90.0, seed, effects)
    return prepare(trials, ship.model)


@cache
def on_time():
    return prepared_with()


@cache
def with_a_late_gyro():
    prepared = prepared_with((Effect("clock_offset", {"offset": LATE}, options={"stream": "yaw_rate"}),))
    [clock] = [a for a in candidates(prepared.structure) if a.label == "clock_offset (yaw_rate)"]
    return fit_from_scratch(prepared.structure.with_effect(clock), prepared.identify)


def test_a_late_gyro_is_asked_for_rates_of_its_own_windows_alone():
    fitted = with_a_late_gyro()
    ordered = in_order_taken(fitted)
    for w in ordered.problem.windows:
        stretch = ordered.problem.stretches[w.stretch]
        taken = stretch.samples.taken[w.samples]
        begin = stretch.start + stretch.h * w.first
        assert begin - 1e-6 <= taken.min()
        assert taken.max() <= begin + stretch.h * w.steps + 1e-6


def test_the_clock_is_known_better_for_it():
    fitted = settled(with_a_late_gyro())
    assert fitted.solution.structure.values(fitted.solution.p, 0)["offset"] == pytest.approx(LATE, abs=0.004)
    assert fitted.chi2_per_dof < 1.05


def test_a_fit_without_late_stamps_stays_as_it_is():
    prepared = on_time()
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    assert in_order_taken(fitted) is fitted


def test_a_model_that_runs_away_from_the_smoothed_motion_keeps_its_first_states(monkeypatch):
    """Else everything that is looked at after it would be infinitely better than it."""
    fitted = with_a_late_gyro()
    smoothed = in_order_taken(fitted)
    lost = replace(smoothed.solution, cost=np.nan)
    monkeypatch.setattr(taken_order, "fit_states", lambda *_: lost)
    kept = in_order_taken(fitted)
    assert kept.problem.stretches[0].samples.late[YAW_RATE] == pytest.approx(LATE, abs=0.02)
    assert np.array_equal(kept.solution.first, fitted.solution.first)
    assert kept.chi2_per_dof == pytest.approx(fitted.chi2_per_dof, abs=0.1)
    monkeypatch.setattr(taken_order, "_kept", lambda *_: lost)
    assert in_order_taken(fitted) is fitted


def test_other_logs_are_read_with_the_same_clocks():
    ordered = in_order_taken(with_a_late_gyro()).problem.stretches
    other = on_time().identify[0]
    assert np.array_equal(as_in(ordered, other).samples.late, ordered[0].samples.late)
    assert as_in(on_time().identify, other) is other


@given(st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4))
def test_samples_are_neither_made_nor_changed_by_their_order(late):
    stretch = on_time().identify[0]
    found = by_clocks(stretch, np.array(late)).samples
    assert np.all(np.diff(found.taken) >= 0.0)
    known = {tuple(row) for row in _rows(stretch.samples)}
    assert {tuple(row) for row in _rows(found)} <= known
    at = stretch.samples.t - np.array(late)[stretch.samples.kind]
    assert len(found.t) == np.sum((at >= stretch.start) & (at <= stretch.start + stretch.h * stretch.steps))


def _rows(samples: Samples):
    return np.column_stack([samples.t, samples.kind, samples.value, samples.sigma])


def test_no_window_predicts_the_first_seconds_of_a_log():
    stretch = on_time().identify[0]
    [whole] = cut([stretch], np.inf).windows
    assert whole.first == min(BEFORE, round(SHARE_BEFORE * stretch.steps))
    assert stretch.samples.taken[whole.samples].min() >= stretch.start + stretch.h * whole.first - 1e-6


def test_a_stretch_that_begins_within_a_log_is_predicted_from_its_begin():
    stretch = on_time().identify[0]
    earlier = {k: replace(m, t=m.t - 10.0) for k, m in stretch.inputs.items()}
    assert cut([replace(stretch, inputs=earlier)], np.inf).windows[0].first == 0


@pytest.mark.parametrize("seed", [7, 8])
def test_a_lag_is_found_where_each_log_begins_with_an_order(seed):
    """Half a second's lag answers to the order before the log, which nobody logged."""
    lag = Effect("actuator_lag", {"time_constant": 0.55}, "rudder")
    prepared = prepared_with((lag,), "patrol", seed)
    [active] = [a for a in candidates(prepared.structure) if a.label == "actuator_lag (rudder)"]
    fitted = fit_from_scratch(prepared.structure.with_effect(active), prepared.identify)
    value, sd = fitted.solution.p, np.sqrt(np.diag(covariance_of(fitted)))
    [k] = [k for k, s in enumerate(fitted.solution.structure.slots) if s.effect == 0]
    assert fitted.chi2_per_dof < 1.05
    assert abs(value[k] - 0.55) < 2.5 * sd[k]
    assert sd[k] < 0.02


def test_what_two_sensors_show_is_taken_off_at_the_times_at_which_late_stamps_were_taken():
    """By the stamps, the time since the sample before was none and seconds by turns; waves show in all of them."""
    stretch = replace(on_time().identify[0], drifts=(Drift(0.4, 30.0), Drift(0.02, 10.0, HEADING)))
    samples = stretch.samples
    late = np.array([-2.5, 0.0, 0.3, 0.0])
    stamped = replace(stretch, samples=replace(samples, t=samples.t + late[samples.kind]))
    order = np.argsort(samples.t, kind="stable")
    assert np.all(order == np.arange(len(order)))
    ordered = by_clocks(stamped, late)
    whole = [slice(0, len(samples.t))]
    errors = np.random.default_rng(0).standard_normal((len(samples.t), 2, 1))
    plain, other = (new_in(s.known(np.ones(4), whole), whole[0], errors) for s in (stretch, ordered))
    assert other == pytest.approx(plain, abs=1e-6)
