"""A drift of the positions that is known counts in a fit as its covariance says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from identification_samples import trials_of

from identify.drift import Drift, gains_of, less_drift
from identify.first_states import first_states
from identify.kernel import HEADING, POSITION
from identify.prepare import prepare
from identify.rough_fit import roughly
from identify.windows import cut, moments, tangents_of


@settings(deadline=None)  # the first compiles
@given(st.floats(0.01, 5.0), st.floats(2.0, 200.0), st.integers(0, 2**32 - 1))
def test_what_is_left_is_white_as_the_covariance_says(size, time, seed):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.05, 2.0, 25))
    kind = rng.choice([POSITION, HEADING], 25)
    sigma = rng.uniform(0.02, 0.3, 25)
    columns = rng.standard_normal((25, 2, 3))
    mine = kind == POSITION
    drift = size**2 * np.exp(-np.abs(np.subtract.outer(t[mine], t[mine])) / time)
    covariance = np.eye(int(mine.sum())) + drift / sigma[mine] / sigma[mine][:, None]
    gains = gains_of(Drift(size, time), t, kind, sigma, [slice(0, 25)])
    left = less_drift(gains, kind, slice(0, 25), columns)
    for axis in range(2):
        expected = columns[mine, axis].T @ np.linalg.solve(covariance, columns[mine, axis])
        assert left[mine, axis].T @ left[mine, axis] == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert np.array_equal(left[~mine], columns[~mine])


def drifting_problem():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 3, ())
    prepared = prepare(trials, ship.model)
    stretches = [replace(s, drift=Drift(0.5, 40.0)) for s in prepared.identify]
    return prepared.structure, cut(stretches, 20.0)


def test_moments_are_products_of_what_is_left_of_rows_and_errors():
    structure, problem = drifting_problem()
    p = roughly(structure, problem.stretches, np.zeros(len(structure.slots)), 5.0)
    first = first_states(problem)
    found = moments(problem, structure, p, first)
    rows = tangents_of(problem, structure, p, first)
    for number, (tangents, left) in enumerate(zip(rows, found.residuals, strict=True)):
        columns = np.concatenate([tangents, left[:, :, None]], axis=2).reshape(2 * len(left), -1)
        assert found.matrices[number] == pytest.approx(columns.T @ columns, rel=1e-6, abs=1e-6)
