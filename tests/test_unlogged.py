"""Inputs that are logged less often than they change: what they hide is no lack of the model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import modulus_truth, trials_of

from fixtures.sensors import Suite
from identify import noise
from identify.acting import input_clocks, lead_slot
from identify.base_fit import fit_from_scratch
from identify.bridges import MOST, shapes_of
from identify.effect import Active, Variant
from identify.effects.actuators import ACTUATOR_LAG
from identify.noise import calibrated, calibrated_anew
from identify.prepare import prepare
from identify.report_fit import make_fit
from identify.sample import BATCH
from identify.structure import null_parameters
from identify.unlogged import most_likely, unlogged
from identify.whitening import in_batches, whitening_of
from identify.whole_windows import as_a_whole, over_whole_logs
from identify.windows import moments
from validate import at_its_best
from validate.refits import begun_at
from validate.verdict import _left_over_whole_unseen

SELDOM = Suite(input_rate=4.0)


@cache
def sailed(seldom=True):
    ship, trials = trials_of(
        "catamaran", ("zigzag", "random", "zigzag10"), 80.0, 3, (), suite=SELDOM if seldom else Suite()
    )
    prepared = prepare(trials, "modulus")
    return ship, prepared, fit_from_scratch(prepared.structure, prepared.identify)


def test_a_log_at_four_hertz_leaves_a_clean_campaign_clean():
    ship, prepared, fitted = sailed()
    assert fitted.problem.unlogged.share > 0.2
    assert 0.9 < fitted.chi2_per_dof < 1.15
    bare = replace(fitted.problem, unlogged=None)
    s = fitted.solution
    raw = moments(bare, s.structure, s.p, s.first)
    assert raw.cost > 5.0 * s.moments.cost  # which the inputs' changes alone had made
    truth = modulus_truth(ship)
    fit = make_fit(prepared, fitted, estimator="output_error", optimiser="auto", seed=0)
    large = [c for c in fit.coefficients if c.stderr < 0.05 * abs(truth[c.dof, c.term])]
    assert len(large) >= 8
    assert all(c.value / truth[c.dof, c.term] == pytest.approx(1.0, abs=0.15) for c in large)


@pytest.mark.parametrize("rate", [10.0, 20.0, 50.0])
def test_orders_that_come_between_samples_leave_a_clean_campaign_clean(rate):
    """Orders come 77 times a second; the compass is good enough to show some milliseconds' doubt of each."""
    suite = Suite(input_rate=rate, helm_rate=77.0)
    ship, trials = trials_of("catamaran", ("zigzag", "random", "zigzag10"), 80.0, 3, (), suite=suite)
    prepared = prepare(trials, ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    bare = replace(fitted.problem, unlogged=None)
    s = fitted.solution
    assert 0.9 < fitted.chi2_per_dof < 1.15
    assert moments(bare, s.structure, s.p, s.first).cost > 1.1 * s.moments.cost


def test_a_log_at_every_change_hides_next_to_nothing():
    _, _, fitted = sailed(seldom=False)
    assert fitted.problem.unlogged is None or fitted.problem.unlogged.share < 0.02


def test_whitening_is_that_of_the_covariance():
    """The moments' cost is eᵀ (1 + G Gᵀ)⁻¹ e, and the white errors' squares add up to it."""
    _, _, fitted = sailed()
    s, problem = fitted.solution, fitted.problem
    bare = moments(replace(problem, unlogged=None), s.structure, s.p, s.first)
    whitening = problem.whitening
    for k, w in enumerate(problem.windows):
        basis, shrink = whitening.basis[w.stretch][w.samples], whitening.shrink[k]
        e, v = bare.residuals[k].ravel(), basis[:, :, shrink > 0].reshape(-1, int(np.sum(shrink > 0)))
        assert np.allclose(v.T @ v, np.eye(v.shape[1]), atol=1e-6)
        covariance = np.eye(len(e)) + v @ np.diag(shrink[shrink > 0] / (1.0 - shrink[shrink > 0])) @ v.T
        expected = e @ np.linalg.solve(covariance, e)
        assert np.isclose(s.moments.matrices[k, -1, -1], expected, rtol=1e-5)
        assert np.isclose(np.sum(s.moments.residuals[k] ** 2), expected, rtol=1e-5)


def test_what_inputs_hide_is_asked_for_though_errors_are_at_the_noise(monkeypatch):
    """They average to it, and a load that takes them along is likely all the same."""
    _, _, fitted = sailed(seldom=False)
    bare = replace(fitted.problem, unlogged=None)
    assert calibrated(bare, fitted.solution).dispersed.inflation.max() < 1.05
    asked = []
    monkeypatch.setattr(noise, "most_likely", lambda *_: asked.append("what is hidden"))
    calibrated_anew(bare, fitted.solution)
    assert asked


def test_an_answer_that_is_rounded_to_all_of_an_error_leaves_a_determinant():
    """A rich model that runs away answers to what is hidden with many times what its sensors would notice."""
    _, _, fitted = sailed()
    runaway = [(1e12 * size, answers) for size, answers in fitted.problem.hidden]
    shrink = whitening_of(fitted.problem, runaway).shrink
    assert shrink.max() > 1.0 - 1e-15
    assert np.isfinite(np.log1p(-shrink)).all()


def test_whole_logs_are_asked_where_something_is_hidden_and_leave_nothing_of_a_clean_campaign():
    """The fit stays in its windows, but what unseen logs as a whole say of it is heard."""
    _, prepared, fitted = sailed()
    assert over_whole_logs(fitted) is fitted
    whole = as_a_whole(fitted)
    assert len(whole.problem.windows) == len(prepared.identify)
    assert all(left < 0.02 for left in _left_over_whole_unseen(prepared, fitted).values())


def test_shapes_move_a_change_by_a_twelfth_of_its_interval_squared():
    """A change that may come at any time within an interval T has a variance of T²/12."""
    _, _, fitted = sailed()
    stretch, s = fitted.problem.stretches[0], fitted.solution
    shapes = shapes_of(s.structure, s.p, stretch, [(0, stretch.steps)])
    assert 0 < shapes.count <= MOST
    place = s.structure.table.channels.index("T:thruster")
    area = np.abs(shapes.mean[:, :, place].sum(axis=0)) * stretch.h
    logged = [stretch.inputs[i.name] for i in s.structure.inputs]
    jumps = np.concatenate([np.abs(np.diff(np.abs(m.value) * m.value)) for m in logged])
    largest = np.sort(jumps)[-1] * 0.25 / np.sqrt(12.0)
    assert np.isclose(area.max(), largest, rtol=0.1)


@pytest.mark.parametrize("late", [0.3, 0.8])
def test_what_a_slow_actuator_makes_of_a_change_comes_early_or_late_as_a_whole(late):
    """Each answer to a moved change has the impulse that it has without a lag, be it over many samples."""
    _, _, fitted = sailed()
    stretch, s = fitted.problem.stretches[0], fitted.solution
    name = s.structure.inputs[0].name
    structure = s.structure.with_effect(Active(ACTUATOR_LAG, Variant(name)))
    p = structure.carried(s.p, s.structure)
    p[[slot.name == "time_constant" for slot in structure.slots]] = late
    shapes = shapes_of(structure, p, stretch, [(0, stretch.steps)])
    place = s.structure.table.channels.index("T:thruster")
    impulse = np.abs(shapes.mean[:, :, place].sum(axis=0)) * stretch.h
    logged = stretch.inputs[name]
    jumps = np.abs(np.diff(np.abs(logged.value) * logged.value))
    at = logged.t[1:][np.argsort(jumps)[-3:]]
    assert ((at > stretch.start) & (at < stretch.grid[-1] - 6.0 * late)).all()
    expected = np.sort(jumps)[-3:] * 0.25 / np.sqrt(12.0)
    assert all(np.min(np.abs(impulse - x)) < 0.1 * x for x in expected)


def test_what_hides_nothing_whitens_nothing():
    _, _, fitted = sailed()
    s = fitted.solution
    problem = replace(fitted.problem, unlogged=unlogged(fitted.problem, s.structure, s.p, 1e-12))
    assert not problem.whitening.shrink.any()


def test_errors_far_larger_than_any_answer_come_from_elsewhere():
    """A model that lacks a current leaves a thousand times what the inputs could hide: that says nothing of them."""
    _, _, fitted = sailed()
    s, problem = fitted.solution, replace(fitted.problem, unlogged=None, inflation=np.ones(4))
    raw = moments(problem, s.structure, s.p, s.first).raw
    assert most_likely(problem, s.structure, s.p, raw).share > 0.2
    far = most_likely(problem, s.structure, s.p, [1e3 * e for e in raw])
    assert far is None or not far.share


def test_an_input_that_moves_is_not_late_by_half_an_interval_as_one_that_holds_is():
    _, prepared, _ = sailed()
    structure, stretch = prepared.structure, prepared.identify[0]
    name = next(iter(stretch.inputs))
    moving = replace(stretch, inputs={**stretch.inputs, name: replace(stretch.inputs[name], held=False)})
    p = null_parameters(structure)
    p[lead_slot(structure)] = structure.input_lead[0]
    clocks = input_clocks(structure, p, moving)
    other = next(n for n in clocks if n != name)
    assert clocks[name] == pytest.approx(stretch.start)
    assert clocks[other] == pytest.approx(stretch.start + 0.5 / SELDOM.input_rate, rel=1e-3)


def test_a_fit_begun_anew_is_preferred_by_what_its_own_errors_say_is_hidden(monkeypatch):
    """The more a fit believes to be hidden, the less it has to explain: weights of others are no argument."""
    _, _, fitted = sailed()
    s, problem = fitted.solution, fitted.problem
    much = unlogged(problem, s.structure, s.p, 30.0)
    stale = replace(problem, unlogged=much, dispersion=np.full(4, 4.0))
    believing = begun_at(replace(fitted, problem=stale), s.p, 0)
    assert believing.chi2_per_dof < 0.98 * fitted.chi2_per_dof
    monkeypatch.setattr(at_its_best, "fit_from_scratch", lambda *_, **__: believing)
    found = at_its_best.settled(fitted)
    assert found.problem.dispersion.max() < 2.0
    assert found.problem.unlogged.share <= 1.0


def test_a_fit_that_runs_away_under_its_own_weights_stays_as_it_was(monkeypatch):
    """Else all that is looked at after it is infinitely better."""
    _, _, fitted = sailed(seldom=False)
    lost = replace(fitted, solution=replace(fitted.solution, cost=np.nan))
    monkeypatch.setattr(at_its_best, "under", lambda *_: lost)
    monkeypatch.setattr(at_its_best, "fit_from_scratch", lambda *_, **__: lost)
    assert at_its_best.settled(fitted).chi2_per_dof == pytest.approx(fitted.chi2_per_dof, abs=0.05)


@pytest.mark.parametrize("samples", [1, 4, 7, 16, 21])
@pytest.mark.parametrize("vectors", [0, 1, 5])
def test_rows_are_gone_through_in_batches_in_their_order(samples, vectors):
    random = np.random.default_rng(samples)
    mine, two = random.normal(size=(samples, 2, vectors)), random.random(samples) < 0.5
    rows = [mine[k, axis] for k in range(samples) for axis in range(1 + two[k])]
    count = -(-len(rows) // BATCH)
    batches = in_batches(mine, two).reshape(count, vectors, BATCH)
    found = batches.transpose(0, 2, 1).reshape(count * BATCH, vectors)
    assert np.array_equal(found[: len(rows)], np.array(rows).reshape(len(rows), vectors))
    assert not found[len(rows) :].any()
