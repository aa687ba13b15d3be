"""Logs left out in turn: what a tight prior is for, and how gentle logs are judged."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from identify.base_fit import fit_from_scratch
from identify.left_out import CAP, Refit, Regularised, errors_in_parts, groups_of, joined_regularised
from identify.misfit import misfit_scale
from identify.parameter_covariance import covariance_of
from identify.predict import free_run
from identify.prepare import prepare
from identify.whole_logs import joined_from_simple, regression_start


@cache
def sample(*manoeuvres):
    return prepare(trials_of("catamaran", manoeuvres, 60.0, 5, validate=0)[1], "modulus")


def test_the_prior_that_predicts_logs_left_out_best_is_taken():
    prepared = sample("zigzag", "random", "zigzag10")
    found = joined_regularised(prepared.structure, prepared.identify)
    assert found is not None
    assert len(found.errors) == 3
    assert found.error < 0.2  # the model is exact: logs that were not seen are predicted
    assert found.ridge > 1.0  # and nothing is gained by holding its coefficients


def test_with_few_logs_nothing_is_left_out():
    prepared = sample("zigzag", "random")
    assert groups_of(prepared.identify) == []
    found, plain = (
        f(prepared.structure, prepared.identify) for f in (joined_regularised, joined_from_simple)
    )
    assert found is not None and plain is not None
    assert np.array_equal(found.joined.p, plain.p)
    assert found.error == np.inf


def test_a_tight_prior_holds_coefficients_nearer_to_nothing():
    prepared = sample("zigzag", "random", "zigzag10")
    tight, loose = (regression_start(prepared.structure, prepared.identify, r)[1] for r in (1.0, 10.0))
    simple = prepared.structure.simple
    assert loose.sd[simple] == pytest.approx(10.0 * tight.sd[simple])


def test_errors_over_parts_begin_anew_at_the_measured_motion():
    prepared = sample("zigzag", "random")
    p, _ = regression_start(prepared.structure, prepared.identify)
    p[prepared.structure.simple] *= 0.0  # a vessel without forces goes straight on
    stretch = prepared.identify[0]
    whole, parts = (errors_in_parts(prepared.structure, p, stretch, n) for n in (1, 6))
    begins = np.linspace(0, stretch.steps, 7).astype(int)[:-1]
    assert len(parts) == len(whole) + 5
    assert np.abs(parts[begins + np.arange(6)]).max() < 1e-12
    assert np.abs(whole[begins[1:]]).max(axis=1).min() > 0.01


def test_logs_that_cannot_be_followed_count_alike_however_far_they_run():
    lost, worse = (Regularised(None, 3.0, np.array([0.1, e])) for e in (1.5, CAP))
    assert lost.error == worse.error == pytest.approx(np.sqrt(0.1))
    assert replace(lost, errors=np.array([0.1, 0.5])).error < lost.error


def test_standard_errors_grow_to_what_runs_left_out_ask_for():
    prepared = sample("zigzag", "random", "zigzag10")
    structure = prepared.structure
    fitted = fit_from_scratch(structure, prepared.identify, rounds=0)
    p = fitted.solution.p
    stretches = tuple(replace(s, states=free_run(structure, p, s)) for s in prepared.identify)  # exact at p
    covariance = covariance_of(fitted)
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(covariance + 1e-18 * np.eye(len(covariance)))
    off = 5.0 * (root @ rng.standard_normal((len(root), len(stretches)))).T
    refits = tuple(Refit(frozenset({k}), p + m) for k, m in enumerate(off))
    scale = misfit_scale(structure, stretches, refits, covariance)
    assert 2.5 < scale < 10.0  # refits are five standard errors off
    assert misfit_scale(structure, stretches, refits, 4.0 * covariance) == pytest.approx(
        0.5 * scale, rel=0.02
    )
    assert misfit_scale(structure, stretches, refits, 1e4 * covariance) == 1.0
    exact = replace(fitted, problem=replace(fitted.problem, stretches=stretches))
    grown = covariance_of(replace(exact, refits=refits))
    plain = covariance_of(exact)
    by = misfit_scale(structure, stretches, refits, plain)
    assert np.sqrt(np.diag(grown)) == pytest.approx(by * np.sqrt(np.diag(plain)), rel=1e-6)


def test_a_refit_that_runs_away_counts_as_no_prediction():
    prepared = sample("zigzag", "random", "zigzag10")
    structure, stretches = prepared.structure, prepared.identify
    fitted = fit_from_scratch(structure, stretches, rounds=0)
    away = Refit(frozenset({0}), 50.0 * fitted.solution.p)
    assert np.isfinite(misfit_scale(structure, stretches, (away,), covariance_of(fitted)))
    assert misfit_scale(structure, stretches, (), covariance_of(fitted)) == 1.0
