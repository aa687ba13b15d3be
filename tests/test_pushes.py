"""What pushes the vessel and no log says, known to a fit: what is missing besides shows beside it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from test_disturbance import pushed, sailed

from identify.base_fit import fit_from_scratch
from identify.windows import cut
from validate.pushes import with_pushes_anew, with_pushes_known, without_pushes

#: Jumps of u, v, r, m/s and rad/s, about every two seconds: many times what the sensors' noise leaves open.
GUSTS = (0.02, 0.02, 0.002)
#: About so many s lie between two jumps.
APART = 60.0 / 31.0


@cache
def gusty(seed=1):
    """A fit of the declared model to logs of a catamaran that is pushed about."""
    whole = sailed()
    stretches = pushed(whole, np.random.default_rng(seed), GUSTS).problem.stretches
    return fit_from_scratch(whole.solution.structure, stretches)


@cache
def known(seed=1):
    return with_pushes_known(gusty(seed))


def test_pushes_that_are_all_that_is_left_are_known_and_leave_the_noise():
    push = known().problem.pushes.push
    assert gusty().is_off
    assert not known().is_off
    assert push[:2] == pytest.approx(np.array(GUSTS[:2]) / np.sqrt(APART), rel=0.6)


def test_at_the_noise_a_fit_stays_as_it_was():
    whole = sailed()
    fitted = fit_from_scratch(whole.solution.structure, whole.problem.stretches)
    assert with_pushes_known(fitted) is fitted
    assert with_pushes_anew(fitted) is fitted
    assert without_pushes(fitted) is fitted


def test_parameters_are_nearer_with_pushes_that_are_known():
    """In the geometric mean over draws and coefficients: a push is no answer to a helm."""
    whole = sailed()
    kept = [k for k, s in enumerate(whole.solution.structure.slots) if s.coefficient >= 0]
    ratios = []
    for seed in range(1, 5):
        off = [np.abs(f.solution.p - whole.solution.p)[kept] for f in (gusty(seed), known(seed))]
        ratios.append(np.mean(np.log(off[1] / off[0])))
    assert np.exp(np.mean(ratios)) < 0.8


def test_pushes_are_known_in_windows_of_another_length_too():
    problem = known().problem
    longer = cut(problem.stretches, 60.0).weighted_as(problem)
    answers = longer.unlogged.over(longer)
    assert answers.pushes is problem.pushes
    assert len(answers.pushed) == len(problem.stretches)
    assert all(np.abs(a).max() > 0.0 for a in answers.pushed)


def test_without_them_the_same_parameters_are_off_the_noise_again():
    bare = without_pushes(known())
    assert bare.problem.pushes is None
    assert bare.solution.p == pytest.approx(known().solution.p, rel=1e-3, abs=1e-6)
    assert bare.is_off


def test_told_anew_they_are_as_large_where_nothing_was_missing():
    again = with_pushes_anew(known())
    assert again.problem.pushes.push[:2] == pytest.approx(known().problem.pushes.push[:2], rel=0.2)
