"""What stays unexplained is a prediction's error half a minute ahead, whatever windows the fit was made with."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from fixtures.sensors import Suite
from identify.base_fit import fit_from_scratch
from identify.drift import Drift
from identify.drive import drive
from identify.fitted import FAR, NEAR, SLOW
from identify.kernel import POSITION
from identify.noise import beyond_drift
from identify.output_error import solve
from identify.predict import run, true_first_state
from identify.prepare import prepare
from validate import other_logs, structure_left
from validate.advice import idle_inputs
from validate.other_logs import on_other_logs, with_other_logs
from validate.refits import under
from validate.structure_left import (
    ahead,
    cross_validated,
    over_whole_logs,
    seconds_ahead,
    spread_of,
    structured_share,
)
from validate.verdict import _as_near

LOGS = ("zigzag", "random", "circle", "zigzag10")


def prepared_with(*effects, validate=1):
    _, trials = trials_of("usv", LOGS, 60.0, 5, effects, validate=validate)
    return prepare(trials, "modulus")


def predicted(fitted, channel):
    """Root mean square error of runs of 30 s from the smoothed motion, over the channel's standard deviation."""
    s, errors = fitted.solution, []
    for stretch in fitted.problem.stretches:
        d = drive(s.structure, s.p, stretch)
        steps = round(30.0 / stretch.h)
        for begin in range(0, stretch.steps - steps + 1, steps):
            first = true_first_state(s.structure, d, stretch, begin)
            states = run(s.structure, d, stretch, first, begin, steps)
            errors.append(states[:, 3 + channel] - stretch.states[begin : begin + steps + 1, 3 + channel])
    spread = np.concatenate([x.states[:, 3 + channel] for x in fitted.problem.stretches]).std()
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)) / spread)


@pytest.mark.parametrize("length", [8.0, 30.0])
def test_short_windows_do_not_hide_what_half_a_minute_shows(length):
    prepared = prepared_with(Effect("current", {"speed": 0.4, "direction": 1.0}))
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=length)
    assert predicted(fitted, 0) > 0.1
    assert structured_share(fitted)["u"] == pytest.approx(predicted(fitted, 0), rel=0.1)


def test_nothing_is_left_where_nothing_is_missing():
    prepared = prepared_with()
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    assert max(structured_share(fitted).values()) < 0.03
    unseen = with_other_logs(fitted, prepared.validate)
    assert max(structured_share(unseen, prepared.identify).values()) < 0.03


def test_parameters_do_not_bend_to_unseen_logs_beyond_what_their_own_allow():
    fitted = fit_from_scratch((plain := prepared_with()).structure, plain.identify)
    loaded = prepared_with(Effect("mass_change", {"ratio": 2.0}, options={"logs": (3,)}))
    unseen = with_other_logs(fitted, loaded.validate)
    np.testing.assert_allclose(unseen.solution.p, fitted.solution.p, rtol=1e-5)
    assert max(structured_share(unseen, plain.identify).values()) > 0.1


def test_unseen_logs_are_asked_from_another_begin_where_the_way_from_the_fit_ends_short(monkeypatch):
    fitted = fit_from_scratch((prepared := prepared_with()).structure, prepared.identify)
    unseen = with_other_logs(fitted, prepared.validate)
    solved = []

    def stuck(problem, structure, p, *rest, budget, **options):
        """A search that stays, the first time, where unseen logs are no better followed for all that is lost."""
        away = p * np.linspace(0.7, 1.3, len(p)) if not solved else p
        solved.append(solve(problem, structure, away, *rest, budget=budget if solved else 0, **options))
        return solved[-1]

    monkeypatch.setattr(other_logs, "solve", stuck)
    again = with_other_logs(fitted, prepared.validate)
    assert len(solved) == 3  # as far as it came, and begun anew in two ways
    assert solved[0].total > 1.5 * solved[1].total
    assert again.chi2_per_dof == pytest.approx(unseen.chi2_per_dof, rel=0.01)


@pytest.mark.parametrize(("own", "near"), [(0.9, NEAR), (1.1, 1.1 * NEAR), (1.3, NEAR)])
def test_unseen_logs_are_at_the_noise_where_the_fits_own_are_as_far_from_its_white_part(own, near):
    found = _as_near(SimpleNamespace(chi2_per_dof=own, slow=1.0))
    assert found.chi2_per_dof == pytest.approx(near)
    assert found.slow == SLOW
    assert _as_near(SimpleNamespace(chi2_per_dof=own, slow=2.0)).slow == pytest.approx(2.0 * NEAR)


def test_what_an_input_does_that_rested_in_the_fits_logs_is_not_missing():
    """A bow thruster that is used in the unseen log alone: its coefficients are not known, and no effect is lacking."""
    _, trials = trials_of("tug", ("zigzag", "zigzag10", "zigzag", "random"), 60.0, 5, (), validate=1)
    prepared = prepare(trials, "modulus")
    assert idle_inputs(prepared.identify) == ["bow"]
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    assert max(structured_share(on_other_logs(fitted, prepared.validate)).values()) > 0.1
    unseen = with_other_logs(fitted, prepared.validate)
    assert unseen.chi2_per_dof < NEAR
    assert max(structured_share(unseen, prepared.identify).values()) < 0.03


def test_orders_that_come_between_samples_leave_nothing_to_explain_ahead_of_short_windows():
    """First states that are fitted without what the inputs hide bend to make up for it."""
    suite = Suite(input_rate=4.0, helm_rate=10.0)
    _, trials = trials_of("raft", ("random", "zigzag", "zigzag10"), 90.0, 5, (), suite=suite)
    prepared = prepare(trials, "linear")
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=15.0)
    assert fitted.problem.unlogged is not None
    assert fitted.chi2_per_dof < NEAR
    windows = ahead(fitted).problem.windows
    assert min(w.first for w in windows) == fitted.problem.windows[0].first
    assert sum(w.steps for w in windows) == sum(w.steps for w in fitted.problem.windows)
    assert len(windows) < len(fitted.problem.windows)
    assert max(structured_share(fitted).values()) < 0.05


def test_logs_a_little_off_the_noise_are_not_far_from_what_their_inputs_hide():
    """What the inputs hide adds up over whole logs, and is nothing that a model lacks."""
    suite = Suite(input_rate=4.0, helm_rate=10.0)
    _, trials = trials_of("raft", ("random", "zigzag", "zigzag10"), 90.0, 5, (), suite=suite)
    prepared = prepare(trials, "linear")
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    stretches = tuple(s.weighted(0.8 * s.samples.sigma, np.ones(4)) for s in fitted.problem.stretches)
    fitted = under(replace(fitted.problem, stretches=stretches), fitted)
    assert NEAR < fitted.chi2_per_dof < FAR < ahead(fitted).chi2_per_dof
    assert max(structured_share(fitted).values()) < 0.1  # more would be material


@pytest.mark.parametrize("length, seconds", [(1.2, 30.0), (7.0, 30.0), (112.0, 120.0), (300.0, 150.0)])
def test_a_ship_is_looked_at_as_far_ahead_as_it_needs_to_answer(length, seconds):
    assert seconds_ahead(length) == pytest.approx(seconds)


def test_far_from_the_noise_what_whole_logs_are_off_by_counts():
    """A current that is not in the model drives predictions off, the farther the longer they run."""
    ready = prepared_with(Effect("current", {"speed": 0.5, "direction": 1.0}))
    fitted = fit_from_scratch(ready.structure, ready.identify)
    assert ahead(fitted).chi2_per_dof > FAR
    whole = over_whole_logs(fitted, ready.identify, spread_of(ready.identify))
    share = structured_share(fitted)
    assert all(share[c] >= whole[c] > 0.0 for c in "uvr")


def test_a_wander_excuses_no_errors_that_it_is_too_small_for():
    prepared = prepared_with(Effect("current", {"speed": 0.4, "direction": 1.0}))
    wandering = tuple(replace(s, drifts=(Drift(0.1, 40.0),)) for s in prepared.identify)
    fitted = fit_from_scratch(prepared.structure, wandering, length=30.0)
    assert structured_share(fitted)["u"] == pytest.approx(predicted(fitted, 0), rel=0.15)
    large = tuple(replace(s, drifts=(Drift(10.0, 40.0),)) for s in fitted.problem.stretches)
    for problem, beyond in ((fitted.problem, 1.0), (replace(fitted.problem, stretches=large), 0.0)):
        assert beyond_drift(problem, fitted.solution.moments, POSITION) == pytest.approx(beyond, abs=0.15)


def test_without_a_wander_nothing_is_beyond_it():
    fitted = fit_from_scratch(prepared_with().structure, prepared_with().identify)
    assert beyond_drift(fitted.problem, fitted.solution.moments, POSITION) == 0.0


def test_unseen_logs_speak_against_a_fit_where_no_begin_of_their_own_leads_anywhere(monkeypatch):
    fitted = fit_from_scratch((plain := prepared_with()).structure, plain.identify)
    loaded = prepared_with(Effect("mass_change", {"ratio": 2.0}, options={"logs": (3,)}))
    monkeypatch.setattr(other_logs, "tried", lambda _: None)
    unseen = with_other_logs(fitted, loaded.validate)
    np.testing.assert_allclose(unseen.solution.p, fitted.solution.p, rtol=1e-5)


def test_the_error_of_parts_left_out_is_no_number_where_a_prediction_ran_away(monkeypatch):
    fitted = fit_from_scratch((prepared := prepared_with()).structure, prepared.identify)
    assert max(cross_validated(fitted).values()) < 0.1
    exact = structure_left.window_errors

    def away(fitted, p, first, rows):
        error, rest = exact(fitted, p, first, rows)
        return np.where(np.arange(len(error))[:, None] < 3, [np.nan, 2e3, 0.0], error), rest

    monkeypatch.setattr(structure_left, "window_errors", away)
    rmse = cross_validated(fitted)
    assert rmse["u"] == rmse["v"] == np.inf
    assert rmse["r"] < 0.1


def test_what_the_smoother_itself_is_off_by_is_nothing_that_whole_logs_leave():
    ready = prepared_with(Effect("current", {"speed": 0.3, "direction": 1.0}))
    fitted, spread = fit_from_scratch(ready.structure, ready.identify), spread_of(ready.identify)
    off = []
    for sigma in (0.0, 0.05, 10.0):
        logs = [replace(s, sigmas=np.full_like(s.sigmas, sigma)) for s in ready.identify]
        off.append(over_whole_logs(fitted, logs, spread)["v"])
    assert off[0] > off[1] > off[2] == 0.0
    assert off[0] ** 2 - off[1] ** 2 == pytest.approx((0.05 / spread[1]) ** 2)


def test_first_states_of_a_fit_with_slow_errors_do_not_hide_what_is_missing():
    """Many samples of white noise may bring the cost to the noise; what is slow says that the fit is off it."""
    prepared = prepared_with(Effect("current", {"speed": 0.4, "direction": 1.0}))
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=30.0)
    loud = np.sqrt(fitted.chi2_per_dof)
    stretches = tuple(s.weighted(loud * s.samples.sigma, np.ones(4)) for s in fitted.problem.stretches)
    shares = []
    for slow in (1.0, 3.0):
        dispersion = np.array([slow, slow, 1.0, 1.0])
        problem = replace(fitted.problem, stretches=stretches, inflation=np.ones(4), dispersion=dispersion)
        near = under(problem, fitted)
        assert near.chi2_per_dof < NEAR
        assert near.slow == slow
        shares.append(structured_share(near)["u"])
    assert shares[1] == pytest.approx(predicted(fitted, 0), rel=0.2)
    assert shares[0] < 0.5 * shares[1]
