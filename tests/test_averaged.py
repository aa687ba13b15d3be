"""Means of fits over whole logs: of a model and of its parts, by what they predict of logs that they have not seen."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from identify.averaged import (
    PICKS,
    Expert,
    averaged,
    experts_of,
    mean_of,
    parts_of,
    picked,
    unseen_of,
    words_of,
)
from identify.left_out import CAP
from identify.prediction_fit import fit_far_from_noise
from identify.prepare import prepare
from identify.report_fit import make_fit


@cache
def sample(*manoeuvres, model="modulus"):
    return prepare(trials_of("catamaran", manoeuvres, 60.0, 5, validate=0)[1], model)


@cache
def experts():
    prepared = sample("zigzag", "random", "zigzag10")
    return experts_of(prepared.structure, prepared.identify)


def test_the_parts_of_a_model_are_those_whose_terms_it_has():
    structure = sample("zigzag", "random").structure
    assert [s.model.name for s in parts_of(structure)] == ["linear"]
    assert parts_of(parts_of(structure)[0]) == []


def test_fits_of_a_part_are_the_whole_models_with_nothing_for_what_the_part_lacks():
    structure = sample("zigzag", "random", "zigzag10").structure
    lean = [e for e in experts() if e.model == "linear"]
    assert {e.model for e in experts()} == {"modulus", "linear"} and len(lean) > 1
    own = {structure.key(s) for s in parts_of(structure)[0].slots}
    lacked = [k for k, s in enumerate(structure.slots) if structure.key(s) not in own]
    assert lacked
    for e in lean:
        assert not e.p[lacked].any() and e.p.any()


def test_a_mean_predicts_logs_left_out_no_worse_than_the_best_alone():
    prepared = sample("zigzag", "random", "zigzag10")
    every = unseen_of(prepared.identify)
    mean = picked(prepared.structure, prepared.identify, experts(), every)
    alone = [mean_of(prepared.structure, prepared.identify, (e,), every).error for e in experts()]
    assert mean.alone == min(alone)
    assert mean.error <= mean.alone
    assert 1 <= len(mean.experts) <= PICKS
    assert mean.p == pytest.approx(np.mean([e.p for e in mean.experts], axis=0))
    for refit in mean.refits:
        assert refit.p == pytest.approx(np.mean([e.without[refit.unseen] for e in mean.experts], axis=0))


def test_errors_that_stand_against_one_another_are_averaged_away():
    prepared = sample("zigzag", "random", "zigzag10")
    every = unseen_of(prepared.identify)
    good = picked(prepared.structure, prepared.identify, experts(), every, 1).experts[0]
    place = next(k for k, s in enumerate(prepared.structure.slots) if s.name == "N_r")

    def off(by):
        move = by * (np.arange(len(good.p)) == place)
        return Expert("modulus", 1.0, good.p + move, {g: p + move for g, p in good.without.items()})

    pair = (off(0.3), off(-0.3))
    mean = picked(prepared.structure, prepared.identify, pair, every)
    assert mean.error < 0.5 * mean.alone
    assert mean.p == pytest.approx(good.p, rel=0.1)


def test_a_fit_that_runs_away_without_some_logs_is_held_to_have_failed_there():
    prepared = sample("zigzag", "random", "zigzag10")
    every = unseen_of(prepared.identify)
    whole = experts()[0]
    lost = replace(whole, without={**whole.without, every[0]: np.full(len(whole.p), np.nan)})
    found = mean_of(prepared.structure, prepared.identify, (lost,), every)
    assert found.errors[0] == CAP and found.errors[1] < CAP
    assert [r.unseen for r in found.refits] == every[1:]


def test_with_few_logs_there_is_no_mean():
    prepared = sample("zigzag", "random")
    assert averaged(prepared.structure, prepared.identify) is None


def test_a_fit_far_from_the_noise_says_that_it_is_a_mean():
    prepared = sample("zigzag", "random", "zigzag10", model="linear")
    deaf = replace(
        prepared,
        identify=tuple(
            replace(s, samples=replace(s.samples, sigma=0.02 * s.samples.sigma)) for s in prepared.identify
        ),
    )
    fitted = fit_far_from_noise(deaf.structure, deaf.identify)
    fit = make_fit(deaf, fitted, estimator="output_error", optimiser="auto", seed=0)
    if fitted.mean is None:
        pytest.fail("whole logs were not followed better")
    assert words_of(fitted.mean) in fit.notes
