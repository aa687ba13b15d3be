"""Steps down the cost: along valleys that are bent, and with damping that learns."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from identify.base_fit import fit_from_scratch
from identify.descent import IN_VAIN, Stride, Task
from identify.first_states import first_states, state_precision
from identify.output_error import prior_for, solve
from identify.prepare import prepare
from identify.regression import coefficient_scales, start_by_regression
from identify.settled import settled
from identify.structure import null_parameters
from identify.windows import cut, moments, tangents_of


@cache
def task(model="modulus"):
    _, trials = trials_of("catamaran", ("zigzag", "random"), 60.0, 3)
    prepared = prepare(trials, model)
    structure, stretches = prepared.structure, prepared.identify
    p = start_by_regression(structure, null_parameters(structure), stretches)
    problem = cut(stretches, 20.0)
    prior = prior_for(structure, coefficient_scales(structure, p, stretches))
    low, high = (np.array([s.parameter.bounds[k] for s in structure.slots]) for k in (0, 1))
    anchor = first_states(problem)
    made = Task(problem, structure, prior, anchor, state_precision(structure), low, high)
    return made, made.at(p, settled(problem, structure, p).first)


def test_errors_that_are_added_count_as_if_they_had_been_measured():
    made, here = task()
    rng = np.random.default_rng(1)
    kinds = [made.problem.kinds(w) for w in made.problem.windows]
    added = [0.1 * rng.standard_normal((len(k), 2)) for k in kinds]
    rows = tangents_of(made.problem, made.structure, here.p, here.first)
    plain = here.moments.matrices
    more = moments(made.problem, made.structure, here.p, here.first, added=added).matrices
    for k, (j, a, raw) in enumerate(zip(rows, added, here.moments.raw, strict=True)):
        single = raw[:, 1] == 0.0  # a heading or a rate of turn has one row
        a[single, 1] = 0.0
        expected = np.einsum("mac,ma->c", j, a)
        np.testing.assert_allclose(more[k, :-1, -1] - plain[k, :-1, -1], expected, rtol=1e-6, atol=1e-6)


def test_a_small_step_is_hardly_bent():
    made, here = task()
    way = made.way(here, 1e6)
    bent = made.bent(here, way)
    assert bent is not None
    assert np.linalg.norm(bent.p - way.p) < 0.01 * np.linalg.norm(way.p - here.p)


def test_what_runs_away_beside_a_place_is_not_bent():
    made, here = task()
    way = made.way(here, 1e-3)
    assert made.bent(here, replace(way, first=way.first + 1e200)) is None


def test_damping_near_the_noise_is_eased_with_care_once_a_step_was_too_bold():
    bold = Stride(damping=1e-4)
    assert bold.after(1.0, 1.0).damping == pytest.approx(1e-5)
    warned = bold.shorter(-1.0, -1e6, near=True)
    assert warned.damping == pytest.approx(3e-4)
    assert warned.shorter(-1.0, -1e6, near=True).damping == pytest.approx(3e-4 * 12.0)
    assert warned.after(1.0, 1.0).damping == pytest.approx(1.5e-4)


def test_far_from_the_noise_it_is_not():
    far = Stride(damping=1e-4).shorter(-1.0, -1e6, near=False)
    assert far.damping == pytest.approx(1e-3)
    assert far.shorter(-1.0, -1e6, near=False).damping == pytest.approx(1e-2)
    assert far.after(1.0, 1.0).damping == pytest.approx(1e-4)


def test_only_a_whole_step_that_is_no_good_may_leave_the_valley():
    stride = Stride()
    assert stride.leaves_the_valley(-1e3)
    assert not stride.leaves_the_valley(1.0)
    assert not stride.leaves_the_valley(-np.inf)  # it ran away
    assert not replace(stride, part=0.5).leaves_the_valley(-1e3)


def test_bent_steps_are_given_up_where_they_are_in_vain():
    stride = Stride()
    for _ in range(IN_VAIN):
        assert stride.leaves_the_valley(-1e3)
        stride = stride.having_bent(False).shorter(-1.0, -1e3, near=True)
    assert not stride.leaves_the_valley(-1e3)
    assert stride.having_bent(True).leaves_the_valley(-1e3)


def test_a_search_comes_lower_in_as_many_steps_with_steps_that_are_bent(monkeypatch):
    """A rich model begun beside its own best fit: most of the way is along a valley near the noise."""
    _, trials = trials_of("tanker", ("zigzag", "random"), 60.0, 3)
    prepared = prepare(trials, "cybership2")
    fit = fit_from_scratch(prepared.structure, prepared.identify)
    problem, structure, p = fit.problem, fit.solution.structure, fit.solution.p
    p = p * (1.0 + 0.05 * np.random.default_rng(1).standard_normal(len(p)))
    first = settled(problem, structure, p).first

    def searched():
        anchor = first_states(problem)
        return solve(problem, structure, p, first, fit.prior, anchor=anchor, budget=25, tolerance=0.05).total

    bent = searched()
    monkeypatch.setattr(Stride, "leaves_the_valley", lambda *_: False)
    assert bent < searched() - 1.0


def test_what_a_careful_damping_hides_is_looked_for():
    careful = Stride(damping=1e-3).shorter(-1.0, -1e6, near=True)
    assert careful.bolder.damping == pytest.approx(0.1 * careful.damping)
    assert Stride(damping=1e-3).bolder is None
    assert replace(careful, damping=1e-8).bolder is None
