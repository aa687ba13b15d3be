"""What a report says of how a model was made are names that the command line takes, of what was at work."""

from __future__ import annotations

from functools import cache

import pytest
from identification_samples import trials_of

from identify.fit_with import optimiser_told
from seatrial.names import ESTIMATORS, OPTIMISERS
from validate.analysis import analyse


@cache
def trials():
    return trials_of("tanker", ("zigzag", "zigzag"), 40.0, 3)[1]


@pytest.mark.parametrize(
    ("estimator", "optimiser", "told"),
    [
        ("auto", "auto", ("output_error", "auto")),
        ("ridge", "auto", ("ridge", "auto")),
        ("ls", "aco_r", ("ls", "auto")),
        ("ridge", "cv", ("ridge", "cv")),
    ],
)
def test_an_analysis_tells_the_optimiser_that_was_at_work(estimator, optimiser, told):
    found = analyse(trials(), model="nomoto1", estimator=estimator, optimiser=optimiser, loop=False)
    assert (found.before.estimator, found.before.optimiser) == told
    assert found.before.estimator in ESTIMATORS
    assert found.before.optimiser in OPTIMISERS


def test_an_optimiser_is_told_where_it_changes_something():
    assert optimiser_told("output_error", "de") == "de"
    assert optimiser_told("lssvm", "pso") == "pso"
    assert optimiser_told("weak_form", "pso") == "auto"
    assert optimiser_told("recursive_ls", "auto") == "auto"


def test_an_analysis_tells_the_speeds_that_its_model_is_of():
    found = analyse(trials(), model="nomoto1", estimator="ls", loop=False)
    ahead = next(t for t in trials() if t.role == "identify").states["u"]
    assert found.after.speeds == pytest.approx((ahead.min(), ahead.max()), rel=0.05)
