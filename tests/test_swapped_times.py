"""A slow actuator before a quick hull, and the other way round: which is the actuator's is not left to chance."""

from __future__ import annotations

from functools import cache

import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from identify.structure import null_parameters
from validate.candidates import candidates
from validate.swapped_times import hull_times, with_times_swapped

HULL = [1.94, 1.42, 0.57]  # s, of the fixtures' patrol boat


@cache
def prepared_with(lag):
    _, trials = trials_of("patrol", ("zigzag", "random", "zigzag"), 120.0, 5, lag_of(lag))
    return prepare(trials, "zhu2019")


def lag_of(time):
    return (Effect("actuator_lag", {"time_constant": time}, input="rudder"),)


def begun_with(lag, start):
    """A fit of logs with a slow rudder, and the place of its time constant, searched from another."""
    prepared = prepared_with(lag)
    [active] = [a for a in candidates(prepared.structure) if a.label == "actuator_lag (rudder)"]
    structure = prepared.structure.with_effect(active)
    k = next(k for k, s in enumerate(structure.slots) if s.name == "time_constant")
    p = null_parameters(structure)
    p[k] = start
    return fit_from_scratch(structure, prepared.identify, p), k


@pytest.mark.parametrize("lag", [3.0, 6.0])
def test_a_lag_that_was_taken_for_the_hulls_is_put_right(lag):
    fitted, k = begun_with(lag, 0.2)
    assert fitted.solution.p[k] < 0.7 * lag
    found = with_times_swapped(fitted)
    assert found.solution.p[k] == pytest.approx(lag, rel=0.01)
    assert found.chi2_per_dof < 1.02


@pytest.mark.parametrize("start", [0.2, 1.0])
def test_a_quick_one_before_a_slow_hull_stays(start):
    fitted, k = begun_with(1.0, start)
    assert with_times_swapped(fitted) is fitted
    assert fitted.solution.p[k] == pytest.approx(1.0, abs=0.02)


def test_the_hulls_own_times_are_those_of_small_motions_about_its_speed():
    fitted, _ = begun_with(1.0, 1.0)
    found = hull_times(fitted.solution.structure, fitted.solution.p, fitted.problem.stretches[0])
    assert found == pytest.approx(HULL, rel=0.02)


def test_a_fit_without_a_lag_is_left_alone():
    prepared = prepared_with(1.0)
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    assert with_times_swapped(fitted) is fitted
