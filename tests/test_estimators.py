"""Every estimator through the same checks, then each against what it promises."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from identify.estimators import ESTIMATORS, predict
from identify.estimators.covariance import andrews_lags, clustered, newey_west
from identify.estimators.kernels import gram
from identify.estimators.recursive import current, start, update
from identify.estimators.tuning import Hyper, cross_validate, splits, tune
from identify.estimators.weighted import adaptive_weights, pseudo_median
from identify.optimisers import OPTIMISERS

THETA = np.array([1.0, -2000.0, 0.03, -0.5])
UNITS = np.array([1.0, 1e-3, 100.0, 3.0])
every = pytest.mark.parametrize("name", ESTIMATORS)
with_dual = pytest.mark.parametrize("name", ["lssvm", "eso_lssvm", "wls_svr", "rw_lssvr"])


def data(rows=600, noise=0.05, seed=0, bias=0.0):
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((rows, 4)) * UNITS
    return design, design @ THETA + bias + noise * rng.standard_normal(rows)


def options(name, bias):
    """An intercept, or none, in each estimator's own words."""
    if name == "eso_lssvm":
        return {"C_b": 0.0 if bias else 1e12}
    return {"bias": bias}


# every estimator ----------------------------------------------------------------------------------


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


# covariance ---------------------------------------------------------------------------------------


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


# least squares and ridge --------------------------------------------------------------------------


def test_least_squares_is_accurate_on_an_ill_conditioned_polynomial():
    """A polynomial of degree 5 over 0...20 with exact coefficients of one (as NIST StRD Wampler1)."""
    x = np.arange(21.0)
    design = x[:, None] ** np.arange(6)
    found = ESTIMATORS["ls"].fit(design, design.sum(axis=1), tolerance=1e-12)
    assert np.allclose(found.theta, 1.0, rtol=1e-7)


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


# support vector machines --------------------------------------------------------------------------


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


# weights ------------------------------------------------------------------------------------------


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


# recursive ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("forgetting", [1.0, 0.99])
@pytest.mark.parametrize("bias", [False, True])
def test_stream_equals_weighted_least_squares_however_it_is_cut(forgetting, bias):
    design, target = data(200, bias=0.5)
    state = start(4, forgetting=forgetting, bias=bias)
    for cut in [*np.split(np.arange(200), [1, 2, 50, 51, 120])]:
        state = update(state, design[cut], target[cut])
    weights = forgetting ** np.arange(199.0, -1, -1)
    batch = ESTIMATORS["recursive_ls"].fit(design, target, forgetting=forgetting, bias=bias)
    plain = ESTIMATORS["ls"].fit(design, target, weights=weights, bias=bias)
    assert np.allclose(current(state).theta, plain.theta, rtol=1e-9)
    assert np.allclose(batch.theta, plain.theta, rtol=1e-9)
    assert current(state).bias == pytest.approx(plain.bias, rel=1e-9)


def test_stream_follows_a_change_that_it_may_forget():
    design, target = data(3000)
    later = np.concatenate([target[:1500], design[1500:] @ (2 * THETA)])
    remembering, forgetting = (
        current(update(start(4, forgetting=f), design, later)).theta for f in (1.0, 0.99)
    )
    assert np.allclose(forgetting, 2 * THETA, rtol=1e-3)
    assert not np.allclose(remembering, 2 * THETA, rtol=0.2)


def test_stream_can_be_saved_and_its_old_state_is_untouched():
    design, target = data(100)
    state = update(start(4), design[:50], target[:50])
    saved = pickle.dumps(state)
    on = update(pickle.loads(saved), design[50:], target[50:])
    assert pickle.dumps(state) == saved
    assert np.allclose(on.theta, ESTIMATORS["ls"].fit(design, target).theta)


def test_stream_knows_how_sure_it_is():
    rng = np.random.default_rng(0)
    inside = []
    for _ in range(100):
        design = coloured(rng, 0.8, (1000, 2))
        state = start(2)
        target = design @ [1.0, -2.0] + coloured(rng, 0.8, (1000,))
        for k in range(0, 1000, 100):
            state = update(state, design[k : k + 100], target[k : k + 100])
        found = current(state)
        inside.append(np.abs(found.theta - [1.0, -2.0]) < 1.96 * found.stderr)
    assert np.mean(inside) > 0.9


def test_stream_refuses_what_it_cannot_use():
    with pytest.raises(ValueError, match="forgetting"):
        start(2, forgetting=0.0)
    with pytest.raises(ValueError, match="samples"):
        current(update(start(4), np.ones((2, 4)), np.ones(2)))
    with pytest.raises(ValueError, match="finite"):
        update(start(1), [[np.nan]], [1.0])


# tuning -------------------------------------------------------------------------------------------


@given(
    groups=st.lists(st.integers(0, 12), min_size=20, max_size=80),
    folds=st.integers(2, 5),
    gap=st.integers(0, 2),
)
@settings(deadline=None)
def test_splits_hold_out_every_row_once_and_use_none_near_it(groups, folds, gap):
    labels = np.sort(np.array(groups))
    pairs = splits(len(labels), labels, folds, gap)
    assert np.array_equal(np.sum([held for held, _ in pairs], axis=0), np.ones(len(labels)))
    for held, used in pairs:
        assert not np.any(held & used)
        if len(np.unique(labels)) >= folds:
            assert not set(labels[held]) & set(labels[used])
        distance = np.abs(np.subtract.outer(np.flatnonzero(used), np.flatnonzero(held)))
        same = labels[used][:, None] == labels[held][None, :]
        assert np.all(distance[same] > gap)


def test_cross_validation_is_the_error_on_what_was_not_seen():
    design, target = data(100)
    total = 0.0
    for held, used in splits(100, None, 5):
        theta = np.linalg.lstsq(design[used], target[used], rcond=None)[0]
        total += np.sum((target[held] - design[held] @ theta) ** 2)
    assert cross_validate(ESTIMATORS["ls"], (design, target, None)) == pytest.approx(total / 100)


@pytest.mark.parametrize("optimiser", ["abc", "absas", "cv", "de"])
def test_tuning_finds_a_regularisation_that_predicts(optimiser):
    errors = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        theta = 0.1 * rng.standard_normal(20)
        design, new = rng.standard_normal((30, 20)), rng.standard_normal((500, 20))
        table = design, design @ theta + rng.standard_normal(30), None
        space = [Hyper("C", 1e-4, 1e6)]
        tuned = tune(
            ESTIMATORS["lssvm"], OPTIMISERS[optimiser], lambda _, t=table: t, space, budget=40, seed=seed
        )
        plain = ESTIMATORS["ls"].fit(*table[:2], bias=True)
        errors.append([np.mean((predict(f, new) - new @ theta) ** 2) for f in (tuned.estimate, plain)])
        assert tuned.estimate.hyper["C"] == tuned.hyper["C"]
    ours, least_squares = np.median(errors, axis=0)
    assert ours < 0.4 * least_squares


def smoothing(design, target):
    def build(hyper):
        width = max(1, round(hyper["width"]))
        window = np.ones(width) / width
        filtered = np.array([np.convolve(x, window, mode="same") for x in design.T]).T
        return filtered, np.convolve(target, window, mode="same"), None

    return build


def test_reference_keeps_the_target_from_being_smoothed_to_nothing():
    design, target = data(400, noise=2.0)
    space = [Hyper("width", 1.0, 200.0, of_data=True)]
    common = {"budget": 30, "seed": 1}
    args = ESTIMATORS["ls"], OPTIMISERS["cv"], smoothing(design, target), space
    fooled = tune(*args, **common)
    sound = tune(*args, **common, reference=(design, target, None))
    assert fooled.hyper["width"] > 50
    assert sound.hyper["width"] < 10


def test_own_score_takes_the_place_of_cross_validation():
    tuned = tune(
        ESTIMATORS["lssvm"],
        OPTIMISERS["cv"],
        lambda _: (*data(), None),
        [Hyper("C", 1e-4, 1e4)],
        score=lambda hyper, found: abs(np.log10(hyper["C"]) - 1.0) + 0 * found.sigma,
    )
    assert tuned.hyper["C"] == pytest.approx(10.0, rel=0.01)


def test_tuning_is_repeatable():
    space = [Hyper("C", 1e-4, 1e4), Hyper("C_b", 1e-4, 1e4)]
    args = ESTIMATORS["eso_lssvm"], OPTIMISERS["absas"], lambda _: (*data(80), None), space
    one, two = (tune(*args, seed=5, budget=40) for _ in range(2))
    assert one.hyper == two.hyper
