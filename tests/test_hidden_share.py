"""A candidate gains nothing by what the inputs' own gaps account for without it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from identification_samples import trials_of

from fixtures.sensors import Suite
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from validate.hidden_share import accounted_for
from validate.refits import under


@pytest.fixture(scope="module")
def seldom_logged():
    """A clean fit whose inputs are logged four times a second and change ten times."""
    suite = Suite(input_rate=4.0, helm_rate=10.0)
    _, trials = trials_of("raft", ("random", "zigzag", "zigzag10"), 60.0, 5, (), suite=suite)
    prepared = prepare(trials, "linear")
    return fit_from_scratch(prepared.structure, prepared.identify, length=15.0)


def test_what_the_inputs_hide_counts_where_a_candidates_weights_forget_it(seldom_logged):
    there = under(replace(seldom_logged.problem, unlogged=None), seldom_logged)
    assert seldom_logged.problem.unlogged is not None
    assert accounted_for(seldom_logged, there) > 100.0


def test_nothing_is_accounted_for_twice(seldom_logged):
    again = under(seldom_logged.problem, seldom_logged)
    assert accounted_for(seldom_logged, again) == pytest.approx(0.0, abs=1.0)


def test_nothing_is_accounted_for_where_nothing_is_hidden(seldom_logged):
    bare = replace(seldom_logged, problem=replace(seldom_logged.problem, unlogged=None))
    assert accounted_for(bare, bare) == 0.0
