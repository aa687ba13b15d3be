"""Intervals are as wide as the windows say, one against the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import trials_of
from scipy import stats

from identify.base_fit import fit_from_scratch
from identify.fitted import Fitted
from identify.parameter_covariance import covariance_of
from identify.prepare import prepare
from identify.scattered import EXPECTED, _root, _scatter, _unfitted, with_scatter


def fit(seed: int = 3) -> Fitted:
    _, trials = trials_of("usv", ("random", "zigzag", "random", "circle"), 90.0, seed, validate=0)
    prepared = prepare(trials, "modulus")
    return fit_from_scratch(prepared.structure, prepared.identify)


def test_windows_of_white_noise_scatter_as_the_covariance_says():
    fits = [fit(seed) for seed in range(4)]
    ratios = np.concatenate([_scatter(f, covariance_of(f))[0] for f in fits])
    assert 0.5 < np.mean(ratios) < 1.3


def test_scores_of_windows_come_out_as_they_were_before_the_fit_followed_them():
    """Least squares of few numbers: the variance by residuals is unbiased only once it is told what they lost."""
    random = np.random.default_rng(2)
    x = random.normal(size=(6, 5, 2))
    information = np.einsum("wij,wik->wjk", x, x)
    root = _root(information.sum(axis=0))
    noise = random.normal(size=(4000, 6, 5))
    slope = np.einsum("jk,nwi,wik->nj", root @ root.T, noise, x)
    left = noise - np.einsum("wik,nk->nwi", x, slope)
    scores = np.einsum("nwi,wik->nwk", left, x) @ root
    shares = root.T @ information @ root
    variances = np.mean([np.sum((_unfitted(shares, s) @ root.T) ** 2, axis=0) for s in scores], axis=0)
    assert variances == pytest.approx(np.diag(root @ root.T), rel=0.1)


def test_an_interval_is_never_narrower_and_wide_as_students_where_nothing_scatters_more():
    fitted = fit()
    covariance = covariance_of(fitted)
    grown = with_scatter(fitted, fitted, covariance)
    wider = np.sqrt(np.diag(covariance_of(grown)) / np.diag(covariance))
    ratio, degrees = _scatter(fitted, covariance)
    least = stats.t.ppf(0.975, EXPECTED + degrees) / stats.norm.ppf(0.975)
    assert (wider >= least - 1e-9).all()
    assert wider[ratio <= 1.0] == pytest.approx(least[ratio <= 1.0])
    assert (degrees < len(fitted.problem.windows)).all()


def test_windows_that_scatter_more_than_the_covariance_widen_each_parameter_by_as_much():
    fitted = fit()
    covariance = covariance_of(fitted)
    narrow = with_scatter(fitted, fitted, covariance / 25.0).wider
    plain = with_scatter(fitted, fitted, covariance).wider
    assert (narrow >= plain).all()
    ratio, _ = _scatter(fitted, covariance)
    assert narrow[ratio > 0.5].min() > 1.5


def test_one_window_says_nothing_of_scatter_and_is_the_least_sure():
    _, trials = trials_of("usv", ("random",), 90.0, 3, validate=0)
    prepared = prepare(trials, "modulus")
    alone = fit_from_scratch(prepared.structure, prepared.identify, length=1e3)
    assert len(alone.problem.windows) == 1
    wider = with_scatter(alone, alone, covariance_of(alone)).wider
    assert wider == pytest.approx(stats.t.ppf(0.975, EXPECTED) / stats.norm.ppf(0.975))


def test_far_from_the_noise_nothing_is_said():
    fitted = fit()
    far = replace(fitted, solution=replace(fitted.solution, cost=np.inf))
    assert with_scatter(fitted, far, covariance_of(fitted)).wider is None
