"""Hyper-parameters chosen by blocked cross-validation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.estimators import ESTIMATORS, predict
from identify.estimators.tuning import Hyper, cross_validate, splits, tune
from identify.optimisers import OPTIMISERS

THETA = np.array([1.0, -2000.0, 0.03, -0.5])
UNITS = np.array([1.0, 1e-3, 100.0, 3.0])


def data(rows=600, noise=0.05, seed=0, bias=0.0):
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((rows, 4)) * UNITS
    return design, design @ THETA + bias + noise * rng.standard_normal(rows)


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
