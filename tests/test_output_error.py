"""Output error on simulated campaigns with known truth: parameters, intervals, noise, and what it stands."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import modulus_truth, trials_of

from fixtures.effects import Effect
from fixtures.sensors import Suite
from identify.base_fit import fit_from_scratch
from identify.by_optimiser import box_around, fit_by_optimiser, objective_for
from identify.choose_model import choose_model
from identify.drive import drive
from identify.effect import Active
from identify.effects import CURRENT
from identify.first_states import first_states
from identify.fit_with import fit_with
from identify.output_error import Stopped, prior_for, solve
from identify.parameter_covariance import covariance_of
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.reduction import reduce
from identify.regression import coefficient_scales, couples, start_by_regression
from identify.report_fit import fitted_effect, make_fit
from identify.settled import settled
from identify.stretch import SUBSTEPS
from identify.structure import null_parameters
from identify.term import Term
from identify.windows import cut, moments
from ingest.errors import NotIdentifiable

MANOEUVRES = ("zigzag", "random", "zigzag10")


@cache
def campaign(current=0.0, seed=3):
    effects = [Effect("current", {"speed": current, "direction": 1.2})] if current else []
    return trials_of("catamaran", MANOEUVRES, 80.0, seed, effects)


@cache
def clean_fit():
    prepared = prepare(campaign()[1], "modulus")
    return prepared, fit_declared(prepared)


def test_a_search_in_a_model_that_lacks_an_effect_comes_to_its_end():
    """The cost's valleys are bent there: steps that were damped only, never taken in part, crept on for hundreds."""
    trials = trials_of("catamaran", MANOEUVRES, 80.0, 3, [Effect("heading_bias", {"bias": 0.08})])[1]
    prepared = prepare(trials, "modulus")
    structure, stretches = prepared.structure, prepared.identify
    p = start_by_regression(structure, null_parameters(structure), stretches)
    problem = cut(stretches, 30.0)
    prior = prior_for(structure, coefficient_scales(structure, p, stretches))
    first = settled(problem, structure, p).first
    found = solve(problem, structure, p, first, prior, anchor=first_states(problem))
    assert found.stopped is Stopped.CONVERGED
    assert solve(problem, structure, found.p, found.first, prior, anchor=first_states(problem)).stayed


def test_parameters_come_back_within_their_standard_errors():
    prepared, fitted = clean_fit()
    truth = modulus_truth(campaign()[0])
    fit = make_fit(prepared, fitted, estimator="output_error", optimiser="auto", seed=0)
    assert {(c.dof, c.term) for c in fit.coefficients} == set(truth)
    errors = np.array([(c.value - truth[c.dof, c.term]) / c.stderr for c in fit.coefficients])
    assert np.abs(errors).max() < 4.0
    assert 0.3 < np.sqrt(np.mean(errors**2)) < 2.0  # intervals neither too narrow nor too wide
    gain = next(c for c in fit.coefficients if c.term == "T:thruster")
    assert gain.stderr < 0.05 * gain.value
    assert gain.identifiable


def test_a_clean_campaign_leaves_white_noise():
    _, fitted = clean_fit()
    assert fitted.chi2_per_dof == pytest.approx(1.0, abs=0.08)
    assert fitted.problem.inflation.max() < 1.1
    assert fitted.solution.stopped in (Stopped.CONVERGED, Stopped.BUDGET)


def test_samples_count_as_the_sensors_own_word_on_them_says():
    truth = modulus_truth(campaign()[0])
    fits = []
    for told in (False, True):
        prepared = prepare([partly_noisy(t, told=told) for t in campaign()[1][:2]], "modulus")
        fitted = fit_from_scratch(prepared.structure, prepared.identify, length=15.0, rounds=0)
        fits.append(make_fit(prepared, fitted, estimator="", optimiser="", seed=0).coefficients)
    assert fitted.chi2_per_dof == pytest.approx(1.0, abs=0.08)  # told of it, nothing is left to wonder at
    assert np.median([b.stderr / a.stderr for a, b in zip(*fits, strict=True)]) < 0.5
    assert max(abs(c.value - truth[c.dof, c.term]) / c.stderr for c in fits[1]) < 4.0


def partly_noisy(trial, *, told):
    """A trial of whose positions three in ten have ten times the noise, and whether their sensor says so."""
    m = trial.measurements["position"]
    rng = np.random.default_rng(len(trial.name))
    variance = np.where(rng.random(len(m.t)) < 0.3, 100.0, 1.0)
    more = m.sigma * np.sqrt(variance - 1.0)[:, None] * rng.standard_normal(m.value.shape)
    level = variance.mean()
    noisy = replace(
        m, value=m.value + more, sigma=m.sigma * np.sqrt(level), weight=variance / level if told else None
    )
    return replace(trial, measurements={**trial.measurements, "position": noisy})


def test_a_missing_effect_shows_in_the_noise_and_goes_with_it():
    prepared = prepare(campaign(current=0.3)[1], "modulus")
    without = fit_from_scratch(prepared.structure, prepared.identify, length=10.0)
    structure = prepared.structure.with_effect(Active(CURRENT))
    found = fit_from_scratch(structure, prepared.identify)
    assert without.chi2_per_dof > 3.0
    assert found.chi2_per_dof == pytest.approx(1.0, abs=0.1)
    effect, _ = fitted_effect(structure, found.solution.p, covariance_of(found), 0)
    speed, direction = effect.parameters
    assert abs(speed.value - 0.3) < 4.0 * speed.stderr
    assert abs(np.remainder(direction.value - 1.2 + np.pi, 2 * np.pi) - np.pi) < 4.0 * direction.stderr
    assert speed.stderr < 0.03


def test_eliminating_first_states_is_solving_for_all_at_once():
    prepared, fitted = clean_fit()
    problem, solution = fitted.problem, fitted.solution
    problem = replace(problem, windows=problem.windows[:3])
    first, known = solution.first[:3], np.full(8, 0.5)
    now = moments(problem, prepared.structure, solution.p, first)
    small = reduce(now.matrices, first, first, known)
    k = len(solution.p)
    whole, right = np.zeros((24 + k, 24 + k)), np.zeros(24 + k)
    for w, m in enumerate(now.matrices):
        rows = np.r_[8 * w : 8 * w + 8, 24 : 24 + k]
        whole[np.ix_(rows, rows)] += m[:-1, :-1]
        right[rows] += m[:-1, -1]
        whole[8 * w : 8 * w + 8, 8 * w : 8 * w + 8] += np.diag(known)
    scale = 1.0 / np.sqrt(np.diag(whole))
    everything = scale * np.linalg.solve(whole * scale * scale[:, None], scale * right)
    information, score = small.information.sum(axis=0), small.score.sum(axis=0)
    s = 1.0 / np.sqrt(np.diag(information))
    assert np.allclose(
        everything[24:], s * np.linalg.solve(information * s * s[:, None], s * score), rtol=1e-5
    )


def test_moments_are_the_derivatives_of_the_errors():
    prepared, fitted = clean_fit()
    problem = replace(fitted.problem, windows=fitted.problem.windows[:1])
    p, first = fitted.solution.p, fitted.solution.first[:1]
    slope = -2.0 * moments(problem, prepared.structure, p, first).matrices[0, 8:-1, -1]
    for k, step in enumerate(1e-5 * np.abs(p) + 1e-9):
        up, down = p.copy(), p.copy()
        up[k] += step
        down[k] -= step
        costs = [moments(problem, prepared.structure, x, first).cost for x in (up, down)]
        # where within a step an input switches is left out of the derivative: it matters to the inputs' lead alone
        tolerance = 1e-3 if k in prepared.structure.simple else 0.15
        assert slope[k] == pytest.approx((costs[0] - costs[1]) / (2 * step), rel=tolerance)


def test_bounds_hold_and_are_said():
    prepared, fitted = clean_fit()
    place = next(k for k, s in enumerate(prepared.structure.slots) if s.term and s.term.text == "T:thruster")
    p = fitted.solution.p.copy()
    p[place] = -5.0
    found = solve(fitted.problem, prepared.structure, p, fitted.solution.first, fitted.prior, budget=1)
    assert found.p[place] >= 0.0


def test_a_population_optimiser_lowers_the_error_and_repeats_itself():
    prepared, fitted = clean_fit()
    found, minimum = fit_by_optimiser(prepared, "aco_r", seed=1, budget=300)
    again, _ = fit_by_optimiser(prepared, "aco_r", seed=1, budget=300)
    assert minimum.evaluations <= 300
    assert found.solution.stopped is minimum.stopped
    assert np.array_equal(found.solution.p, again.solution.p)
    assert minimum.value < 0.7 * minimum.history[0, 1]
    structure = prepared.structure
    own = objective_for(cut(prepared.identify, 30.0), structure, found.solution.p)
    truth, best = own(np.array([fitted.solution.p[structure.simple], minimum.x]))
    assert best == pytest.approx(minimum.value, rel=1e-9)
    assert truth < minimum.value


def test_a_candidate_that_runs_away_is_bad_and_not_infinitely_so():
    prepared, fitted = clean_fit()
    structure = prepared.structure
    own = objective_for(cut(prepared.identify, 30.0), structure, fitted.solution.p)
    good = fitted.solution.p[structure.simple]
    mild, wild = own(np.array([good + 0.05, np.abs(good) * 5.0]))
    assert mild < wild < np.inf


def test_the_box_of_a_search_holds_the_truth():
    prepared, _ = clean_fit()
    start = start_by_regression(
        prepared.structure, np.zeros(len(prepared.structure.slots)), prepared.identify
    )
    box = box_around(prepared.structure, start, prepared.identify)
    truth = modulus_truth(campaign()[0])
    true = np.array([truth[s.term.dof, s.term.text] for s in prepared.structure.slots if s.coefficient >= 0])
    assert ((box[:, 0] <= true) & (true <= box[:, 1])).all()


@pytest.mark.parametrize(
    ("estimator", "optimiser"),
    [("ls", "auto"), ("weak_form", "auto"), ("lssvm", "cv"), ("rw_lssvr", "auto"), ("recursive_ls", "auto")],
)
def test_every_regression_comes_near_the_truth(estimator, optimiser):
    prepared, _ = clean_fit()
    found = fit_with(prepared, estimator, optimiser)
    truth = modulus_truth(campaign()[0])
    slots = prepared.structure.slots
    gain = next(k for k, s in enumerate(slots) if s.term and s.term.text == "N:thruster")
    assert found.solution.p[gain] == pytest.approx(truth["r", "N:thruster"], rel=0.3)
    assert np.isfinite(found.solution.cost)
    assert found.solution.stopped is Stopped.SOLVED


def test_first_states_are_the_smoothed_ones():
    prepared, _ = clean_fit()
    problem = cut(prepared.identify, 20.0)
    begin = problem.windows[0].first
    assert np.array_equal(first_states(problem)[0, :6], prepared.identify[0].states[begin])
    assert first_states(problem, np.array([0.1, 0.0]))[0, 3] != prepared.identify[0].states[0, 3]


def test_auto_finds_the_model_that_the_vessel_has():
    name, table = choose_model(campaign()[1])
    assert name == "modulus"
    assert table[0].error < 0.2
    assert [c.note for c in table if c.name == "blanke"] == ["no rudder"]


def test_without_logs_to_identify_on_there_is_no_model():
    trials = [replace(t, role="validate") for t in campaign()[1]]
    with pytest.raises(NotIdentifiable):
        choose_model(trials)
    with pytest.raises(NotIdentifiable):
        prepare(trials, "modulus")


def test_of_samples_minutes_apart_it_is_said_that_times_may_be_milliseconds():
    rare = [
        replace(
            t, segments=(), measurements={k: replace(m, t=1000.0 * m.t) for k, m in t.measurements.items()}
        )
        for t in campaign()[1]
    ]
    with pytest.raises(NotIdentifiable, match=r"a position every \d+ s .* milliseconds.*t_ms"):
        prepare(rare, "modulus")


def test_a_vessel_that_never_moves_has_no_model():
    still = [
        replace(t, measurements={k: replace(m, value=0 * m.value + 1) for k, m in t.measurements.items()})
        for t in campaign()[1]
    ]
    with pytest.raises(NotIdentifiable, match="does not move in any log"):
        prepare(still, "modulus")


def test_a_switch_within_a_part_of_a_step_gives_its_mean_thrust():
    """The thrust of the mean of 0.2 and 1.0 is not the mean of their thrusts."""
    _, trials = trials_of("catamaran", ("zigzag", "random"), 20.0, 3)
    prepared = prepare(trials, "modulus", held=True)
    stretch, structure = prepared.identify[0], replace(prepared.structure, input_lead=None)
    when = stretch.start + stretch.h * (3.0 + 0.4 / SUBSTEPS)
    inputs = {
        n: replace(
            m, t=np.array([stretch.start - 1.0, when]), value=np.array([0.2, 1.0]), good=np.ones(2, bool)
        )
        for n, m in stretch.inputs.items()
    }
    d = drive(structure, null_parameters(structure), replace(stretch, inputs=inputs))
    thrust = d.fine[structure.table.channels.index("T:thruster")] / len(inputs)
    at = 3 * SUBSTEPS
    assert thrust[at - 1 : at + 2] == pytest.approx([0.04, 0.4 * 0.04 + 0.6, 1.0])


def test_a_fit_does_not_take_drift_for_turning():
    """Sway that is smoothed from poor positions lets yaw be damped by drift in the regression, and the fit after it."""
    rng, suite = np.random.default_rng(2), Suite()
    suite = replace(suite, position=replace(suite.position, noise=0.15))
    _, trials = trials_of("usv", ("random", "zigzag", "zigzag"), 90.0, 2, suite=suite)
    mean = np.ones(31) / 31

    def blurred(trial):
        states = trial.states.copy()
        wrong = 0.1 * math.sqrt(31) * np.convolve(rng.normal(size=len(states) + 30), mean, "valid")
        states["v"] = np.convolve(np.pad(states["v"], 15, mode="edge"), mean, "valid") + wrong
        return replace(trial, states=states)

    prepared = prepare([blurred(t) for t in trials], "modulus")
    begin = start_by_regression(prepared.structure, null_parameters(prepared.structure), prepared.identify)
    names = [s.name for s in prepared.structure.slots]
    assert begin[names.index("N_v")] > 0.1
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    assert fitted.chi2_per_dof == pytest.approx(1.0, abs=0.05)
    assert fitted.solution.p[names.index("N_v")] == pytest.approx(-60.0 / 420.0, abs=0.1)


def test_what_another_axis_does_is_told_from_the_centripetal_part():
    told = {
        (d, t): couples(Term(d, t))
        for d, t in (("v", "ur"), ("v", "r"), ("r", "v"), ("r", "r|r|"), ("u", "vr"))
    }
    assert told == {
        ("v", "ur"): False,
        ("v", "r"): True,
        ("r", "v"): True,
        ("r", "r|r|"): False,
        ("u", "vr"): True,
    }
