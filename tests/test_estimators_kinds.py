"""Each estimator against what it promises."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.estimators import ESTIMATORS, predict
from identify.estimators.kernels import gram
from identify.estimators.weighted import adaptive_weights, pseudo_median

THETA = np.array([1.0, -2000.0, 0.03, -0.5])
UNITS = np.array([1.0, 1e-3, 100.0, 3.0])
with_dual = pytest.mark.parametrize("name", ["lssvm", "eso_lssvm", "wls_svr", "rw_lssvr"])


def data(rows=600, noise=0.05, seed=0, bias=0.0):
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((rows, 4)) * UNITS
    return design, design @ THETA + bias + noise * rng.standard_normal(rows)


def test_least_squares_is_accurate_on_an_ill_conditioned_polynomial():
    """A polynomial of degree 5 over 0...20 with exact coefficients of one (as NIST StRD Wampler1)."""
    x = np.arange(21.0)
    design = x[:, None] ** np.arange(6)
    found = ESTIMATORS["ls"].fit(design, design.sum(axis=1), tolerance=1e-12)
    assert np.allclose(found.theta, 1.0, rtol=1e-7)


@pytest.mark.parametrize("nearness", [1e-1, 1e-3, 1e-5, 1e-7])
def test_nearly_collinear_columns_are_solved_as_accurately_as_by_qr(nearness):
    """Whichever way the problem is reduced: by its Gram matrix, refined, or by Householder's QR."""
    rng = np.random.default_rng(0)
    design = rng.standard_normal((400, 3))
    design[:, 2] = design[:, 0] + nearness * design[:, 2]
    target = design @ [1.0, 2.0, -1.0] + 1e-9 * rng.standard_normal(400)
    direct = np.linalg.lstsq(design, target, rcond=None)[0]
    found = ESTIMATORS["ls"].fit(design, target, tolerance=1e-10)
    assert np.allclose(found.theta, direct, atol=1e-13 / nearness)
    regularised = ESTIMATORS["lssvm"].fit(design, target, C=1e14, bias=False)
    assert np.allclose(regularised.theta, direct, atol=max(1e-9, 1e-8 * nearness**-1))


def test_known_weights_are_used():
    design, target = data()
    weights = np.random.default_rng(0).uniform(0.1, 2, len(target))
    root = np.sqrt(weights)
    direct = np.linalg.lstsq(design * root[:, None], target * root, rcond=None)[0]
    assert np.allclose(ESTIMATORS["ls"].fit(design, target, weights=weights).theta, direct)


@given(penalty=st.floats(1e-8, 10), seed=st.integers(0, 99))
@settings(max_examples=20, deadline=None)
def test_ridge_with_a_given_penalty_solves_its_equations(penalty, seed):
    design, target = data(60, seed=seed, noise=1.0)
    scaled = design / np.sqrt(np.mean(design**2, axis=0))
    direct = np.linalg.solve(scaled.T @ scaled + 60 * penalty * np.eye(4), scaled.T @ target)
    found = ESTIMATORS["ridge"].fit(design, target, penalty=penalty)
    assert np.allclose(found.theta * np.sqrt(np.mean(design**2, axis=0)), direct)


def test_cross_validated_ridge_predicts_better_than_least_squares_from_little():
    rng = np.random.default_rng(3)
    ridge, plain = [], []
    for _ in range(40):
        theta = 0.3 * rng.standard_normal(20)
        design = rng.standard_normal((30, 20)) @ np.diag(np.logspace(0, -1, 20))
        target = design @ theta + 0.5 * rng.standard_normal(30)
        new = rng.standard_normal((200, 20)) @ np.diag(np.logspace(0, -1, 20))
        for name, errors in (("ridge", ridge), ("ls", plain)):
            found = ESTIMATORS[name].fit(design, target, covariance="none")
            errors.append(np.mean((predict(found, new) - new @ theta) ** 2))
    assert np.median(ridge) < 0.7 * np.median(plain)


def test_generalised_cross_validation_agrees_with_its_definition():
    design, target = data(40, noise=3.0)
    chosen = ESTIMATORS["ridge"].fit(design, target, bias=True).hyper["penalty"]
    rows = np.column_stack([design / np.sqrt(np.mean(design**2, axis=0)), np.ones(40)])

    def score(penalty):
        hat = rows @ np.linalg.solve(rows.T @ rows + 40 * penalty * np.diag([1, 1, 1, 1, 0]), rows.T)
        return np.sum((target - hat @ target) ** 2) / (40 - np.trace(hat)) ** 2

    assert all(score(chosen) <= score(chosen * f) * (1 + 1e-9) for f in (0.1, 0.5, 2, 10))


@with_dual
@pytest.mark.parametrize("scaled", [True, False])
@pytest.mark.parametrize("regularisation", [1e-3, 1.0, 1e4])
def test_primal_and_dual_agree(name, scaled, regularisation):
    rng = np.random.default_rng(4)
    design = rng.standard_normal((150, 4)) * [1, 0.5, 2, 1]
    target = design @ [1.0, -2.0, 0.3, 0.0] + 0.4 + 0.1 * rng.standard_normal(150)
    common = {"C": regularisation, "scaled": scaled}
    one, two = (ESTIMATORS[name].fit(design, target, form=form, **common) for form in ("primal", "dual"))
    assert np.allclose(one.theta, two.theta, rtol=1e-7, atol=1e-9)
    assert one.bias == pytest.approx(two.bias, rel=1e-7, abs=1e-9)
    assert np.allclose(one.stderr, two.stderr, rtol=1e-5)


@pytest.mark.parametrize("penalty", [0.0, 1.0, 1e3])
def test_penalised_bias_solves_the_printed_system(penalty):
    """Xie et al. 2020, eq. 28, in their own words: raw columns, Ω with 1/C on its diagonal."""
    design, target = data(80, bias=2.0)
    system = np.zeros((81, 81))
    system[1:, 1:] = design @ design.T + np.eye(80) / 10
    system[0, 1:] = system[1:, 0] = 1
    system[0, 0] = -penalty
    solved = np.linalg.solve(system, np.append(0, target))
    found = ESTIMATORS["eso_lssvm"].fit(design, target, C=10.0, C_b=penalty, scaled=False)
    assert found.bias == pytest.approx(solved[0], rel=1e-6)
    assert np.allclose(found.theta, design.T @ solved[1:], rtol=1e-6)


def test_penalised_bias_goes_from_free_to_none():
    design, target = data(bias=2.0)
    biases = [ESTIMATORS["eso_lssvm"].fit(design, target, C_b=c).bias for c in (0.0, 1e8, 1e10, 1e14)]
    assert np.all(np.diff(biases) < 0)
    assert biases[0] == pytest.approx(2.0, abs=0.02)
    assert biases[-1] == pytest.approx(0.0, abs=1e-2)


def test_a_dropped_bias_is_what_spoils_the_published_fit():
    """Xie et al. 2020, eq. 14: w from a fit with b, then used without it."""
    design, target = data(bias=2.0)
    found = ESTIMATORS["lssvm"].fit(design, target)
    with_b, without = target - predict(found, design), target - design @ found.theta
    assert np.mean(without**2) > 100 * np.mean(with_b**2)


def test_regularisation_shrinks():
    design, target = data()
    norms = [
        np.linalg.norm(ESTIMATORS["lssvm"].fit(design, target, C=c).theta * UNITS) for c in (1e-4, 1e-2, 1e2)
    ]
    assert np.all(np.diff(norms) > 0)


@pytest.mark.parametrize("kernel", ["rbf", "polynomial"])
def test_other_kernels_fit_what_no_line_can(kernel):
    rng = np.random.default_rng(0)
    design = rng.uniform(-1, 1, (300, 2))
    target = design[:, 0] ** 3 + design[:, 0] * design[:, 1] + 0.5
    new = rng.uniform(-0.9, 0.9, (50, 2))
    found = ESTIMATORS["lssvm"].fit(design, target, kernel=kernel, kernel_parameters={"width": 1.5}, C=1e6)
    truth = new[:, 0] ** 3 + new[:, 0] * new[:, 1] + 0.5
    assert np.max(np.abs(predict(found, new) - truth)) < 0.01
    assert np.isnan(found.theta).all()
    assert not found.identifiable.any()
    assert kernel in found.reasons[0]


def test_kernels_are_what_they_say():
    a, b = np.array([[1.0, 2.0]]), np.array([[0.5, -1.0]])
    assert gram("linear", {}, a, b)[0, 0] == -1.5
    assert gram("rbf", {"width": 2.0}, a, b)[0, 0] == pytest.approx(np.exp(-9.25 / 4))
    assert gram("polynomial", {"degree": 2.0, "offset": 3.0}, a, b)[0, 0] == 2.25
    with pytest.raises(ValueError, match="kernel"):
        gram("sigmoid", {}, a, b)


def test_dual_of_many_rows_is_refused():
    with pytest.raises(ValueError, match="primal"):
        ESTIMATORS["lssvm"].fit(np.random.default_rng(0).random((20_001, 1)), np.zeros(20_001), form="dual")


@pytest.mark.parametrize("wrong", [{"C": 0.0}, {"C": -1.0}])
def test_senseless_regularisation_is_refused(wrong):
    with pytest.raises(ValueError, match="C > 0"):
        ESTIMATORS["lssvm"].fit(*data(), **wrong)


def test_weights_fall_with_the_size_of_the_error_whatever_its_sign():
    error = np.array([-3.0, -1.0, -0.5, 0.0, 0.2, 0.7, 1.5, 8.0])
    weights = adaptive_weights(error)
    order = np.argsort(np.abs(error))
    assert np.all(np.diff(weights[order]) < 0)
    assert weights.max() == 1.0


@given(st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=60))
def test_pseudo_median_is_eq_24_of_sizes(errors):
    ordered = np.sort(np.abs(errors))
    n = len(ordered) // 4
    expected = np.mean([np.median(ordered[n : 2 * n]), np.median(ordered[2 * n : 3 * n])])
    assert pseudo_median(np.array(errors)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["wls_svr", "rw_lssvr"])
def test_outliers_lose_their_weight(name):
    design, target = data(noise=0.05)
    bad = np.random.default_rng(1).choice(600, 60, replace=False)
    target[bad] += 20.0
    found = ESTIMATORS[name].fit(design, target)
    assert found.weights[bad].max() < 0.05 * np.median(found.weights)


def test_adapted_weights_stand_ten_per_cent_of_outliers():
    """Error of prediction within 1.2 times the one without outliers, where least squares' is far above."""
    rng = np.random.default_rng(7)
    errors = {"clean": [], "rw_lssvr": [], "ls": []}
    new = rng.standard_normal((500, 4)) * UNITS
    for seed in range(20):
        design, target = data(seed=seed, noise=0.3, bias=0.2)
        spoiled = target.copy()
        bad = rng.choice(600, 60, replace=False)
        spoiled[bad] += rng.uniform(5, 20, 60)
        fits = {
            "clean": ESTIMATORS["rw_lssvr"].fit(design, target),
            "rw_lssvr": ESTIMATORS["rw_lssvr"].fit(design, spoiled),
            "ls": ESTIMATORS["ls"].fit(design, spoiled, bias=True),
        }
        for key, found in fits.items():
            noise = 0.3 * rng.standard_normal(500)
            errors[key].append(np.mean((predict(found, new) - new @ THETA - 0.2 + noise) ** 2))
    clean, robust, plain = (np.median(errors[k]) for k in ("clean", "rw_lssvr", "ls"))
    assert robust < 1.2 * clean
    assert plain > 3 * clean


def test_adaptation_says_when_it_did_not_settle():
    found = ESTIMATORS["rw_lssvr"].fit(*data(), iterations=1)
    assert "Stopped at 1" in found.stopped
    assert "settled" in ESTIMATORS["rw_lssvr"].fit(*data()).stopped
