"""Every estimator through the same checks; the covariance on its own."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from scipy.signal import lfilter

from identify.estimators import ESTIMATORS, predict
from identify.estimators.covariance import andrews_lags, clustered, newey_west

THETA = np.array([1.0, -2000.0, 0.03, -0.5])
UNITS = np.array([1.0, 1e-3, 100.0, 3.0])
every = pytest.mark.parametrize("name", ESTIMATORS)


def data(rows=600, noise=0.05, seed=0, bias=0.0):
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((rows, 4)) * UNITS
    return design, design @ THETA + bias + noise * rng.standard_normal(rows)


def options(name, bias):
    """An intercept, or none, in each estimator's own words."""
    if name == "eso_lssvm":
        return {"C_b": 0.0 if bias else 1e12}
    return {"bias": bias}


@every
@pytest.mark.parametrize("bias", [0.0, 0.7])
def test_recovers_the_truth_within_its_own_errors(name, bias):
    design, target = data(bias=bias)
    found = ESTIMATORS[name].fit(design, target, **options(name, bias != 0))
    assert np.all(np.abs(found.theta - THETA) < 4 * found.stderr)
    assert found.stderr == pytest.approx(0.05 / np.sqrt(600) / UNITS, rel=0.6)
    assert found.sigma == pytest.approx(0.05, rel=0.15)
    assert found.bias == pytest.approx(bias, abs=0.02)
    assert found.identifiable.all()
    assert found.reasons == ("",) * 4
    assert np.allclose(predict(found, design), target, atol=0.3)


@every
def test_exact_data_give_exact_coefficients(name):
    design, target = data(noise=0.0)
    found = ESTIMATORS[name].fit(design, target)
    assert np.allclose(found.theta * UNITS, THETA * UNITS, rtol=1e-5)


@every
def test_units_of_the_columns_do_not_matter(name):
    design, target = data(bias=0.3)
    factor = np.array([1e6, 1e-7, 3.0, 1e3])
    one, two = (ESTIMATORS[name].fit(x, target) for x in (design, design * factor))
    assert np.allclose(one.theta, two.theta * factor, rtol=1e-7)
    assert np.allclose(one.stderr, two.stderr * factor, rtol=1e-5)


@every
def test_collinear_columns_are_named(name):
    design, target = data()
    target = target - design[:, 3] * THETA[3]
    design[:, 3] = -4 * design[:, 0]
    found = ESTIMATORS[name].fit(design, target, names=("a", "b", "c", "d"))
    assert list(found.identifiable) == [False, True, True, False]
    assert "a" in found.reasons[3].split()
    assert "d" in found.reasons[0].split()
    assert np.allclose(predict(found, design), target, atol=0.3)


@every
def test_zero_column_is_named(name):
    design, target = data()
    design[:, 2] = 0.0
    found = ESTIMATORS[name].fit(design, target)
    assert found.theta[2] == 0.0
    assert "zero" in found.reasons[2]


@every
def test_coefficient_in_the_noise_is_not_identifiable(name):
    rng = np.random.default_rng(2)
    design, target = data(noise=1.0)
    design = np.column_stack([design, rng.standard_normal(len(target))])
    found = ESTIMATORS[name].fit(design, target)
    assert not found.identifiable[4]
    assert "standard error" in found.reasons[4]


@every
def test_estimate_is_frozen_and_picklable(name):
    found = ESTIMATORS[name].fit(*data())
    with pytest.raises(FrozenInstanceError):
        found.sigma = 1.0
    assert np.array_equal(pickle.loads(pickle.dumps(found)).theta, found.theta)
    assert found.stopped.endswith(".")


@every
@pytest.mark.parametrize(
    ("design", "target", "match"),
    [
        (np.ones((5, 2)), np.ones(4), "expected design"),
        (np.ones((2, 2)), np.ones(2), "more rows"),
        (np.full((9, 1), np.nan), np.ones(9), "finite"),
        (np.arange(9.0)[:, None], np.full(9, np.inf), "finite"),
    ],
)
def test_bad_data_are_refused(name, design, target, match):
    with pytest.raises(ValueError, match=match):
        ESTIMATORS[name].fit(design, target)


@every
def test_constant_column_takes_the_place_of_the_bias(name):
    design, target = data(bias=0.7)
    design = np.column_stack([design, np.full(len(target), 2.0)])
    found = ESTIMATORS[name].fit(design, target)
    assert found.bias == 0.0
    assert found.theta[4] == pytest.approx(0.35, abs=0.02)
    assert found.identifiable.all()


def coloured(rng, rho, shape):
    drawn = lfilter(
        [np.sqrt(1 - rho**2)], [1, -rho], rng.standard_normal((shape[0] + 200, *shape[1:])), axis=0
    )
    return drawn[200:]


@pytest.mark.parametrize("name", ["ls", "lssvm", "wls_svr", "recursive_ls"])
@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_intervals_cover_with_correlated_residuals(name, rho):
    rng = np.random.default_rng(5)
    inside = []
    for _ in range(150):
        design = coloured(rng, rho, (800, 2))
        found = ESTIMATORS[name].fit(design, design @ [1.0, -2.0] + coloured(rng, rho, (800,)))
        inside.append(np.abs(found.theta - [1.0, -2.0]) < 1.96 * found.stderr)
    assert 0.88 < np.mean(inside) < 0.99


def test_naive_covariance_does_not_cover():
    rng = np.random.default_rng(5)
    inside = []
    for _ in range(100):
        design = coloured(rng, 0.9, (800, 2))
        found = ESTIMATORS["ls"].fit(
            design, design @ [1.0, -2.0] + coloured(rng, 0.9, (800,)), covariance="iid"
        )
        inside.append(np.abs(found.theta - [1.0, -2.0]) < 1.96 * found.stderr)
    assert np.mean(inside) < 0.6


@pytest.mark.parametrize("lags", [0, 1, 4, 10, 25, 60])
def test_newey_west_is_the_weighted_sum_of_autocovariances(lags):
    scores = np.random.default_rng(1).standard_normal((50, 3))
    groups = np.repeat([4, 1, 2], [30, 3, 17])
    direct = np.zeros((3, 3))
    for label in np.unique(groups):
        part = scores[groups == label]
        away = np.abs(np.subtract.outer(np.arange(len(part)), np.arange(len(part))))
        direct += part.T @ np.maximum(1 - away / (lags + 1), 0) @ part
    assert np.allclose(newey_west(scores, groups, lags), direct)


def test_clusters_sum_within_groups():
    scores = np.arange(12.0).reshape(6, 2)
    groups = np.array([0, 1, 0, 1, 2, 2])
    sums = np.array([scores[groups == g].sum(axis=0) for g in range(3)])
    assert np.allclose(clustered(scores, groups), sums.T @ sums * 3 / 2)


def test_groups_do_not_correlate_with_each_other():
    """Two copies of a record are one record twice: clusters see it, and a break in time is not bridged."""
    design, target = data(300)
    twice = np.vstack([design, design]), np.concatenate([target, target])
    labels = np.tile(np.arange(300), 2)
    alone = ESTIMATORS["ls"].fit(design, target, covariance="white")
    both = ESTIMATORS["ls"].fit(*twice, groups=labels, covariance="cluster")
    assert both.stderr == pytest.approx(alone.stderr, rel=0.02)


def test_lags_grow_with_correlation():
    rng = np.random.default_rng(0)
    few, many = (andrews_lags([coloured(rng, rho, (2000, 2))]) for rho in (0.1, 0.95))
    assert few < 12 < many
