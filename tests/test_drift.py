"""A drift of the positions that is known counts in a fit as its covariance says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from identification_samples import trials_of

from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch
from identify.drift import Drift
from identify.first_states import first_states
from identify.innovations import filter_of, new_in, since_used
from identify.kernel import HEADING, POSITION
from identify.prepare import prepare, with_pooled_noise
from identify.rough_fit import roughly
from identify.windows import cut, moments, tangents_of


@settings(deadline=None)  # the first compiles
@given(st.floats(0.01, 5.0), st.floats(2.0, 200.0), st.booleans(), st.integers(0, 2**32 - 1))
def test_what_is_left_is_white_as_the_covariance_says(size, time, smooth, seed):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.05, 2.0, 25))
    kind = rng.choice([POSITION, HEADING], 25)
    sigma = rng.uniform(0.02, 0.3, 25)
    columns = rng.standard_normal((25, 2, 3))
    mine = kind == POSITION
    apart = np.abs(np.subtract.outer(t[mine], t[mine])) / time
    drift = size**2 * np.exp(-apart) * (1.0 + apart if smooth else 1.0)
    covariance = np.eye(int(mine.sum())) + drift / sigma[mine] / sigma[mine][:, None]
    process = Drift(size, time, smooth=smooth).process(since_used(t, mine), kind)
    known = filter_of(process, sigma, mine, [slice(0, 25)])
    left = new_in(known, slice(0, 25), columns)
    for axis in range(2):
        expected = columns[mine, axis].T @ np.linalg.solve(covariance, columns[mine, axis])
        assert left[mine, axis].T @ left[mine, axis] == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert known.information(slice(0, 25)) == pytest.approx(
        2.0 * np.linalg.slogdet(covariance)[1], rel=1e-6, abs=1e-9
    )
    assert np.array_equal(left[~mine], columns[~mine])


def drifting_problem():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 3, ())
    prepared = prepare(trials, ship.model)
    stretches = [replace(s, drifts=(Drift(0.5, 40.0),)) for s in prepared.identify]
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


def wandering_trials(sizes):
    """Trials whose receiver's errors were told to wander by so much, m, in each log."""
    _, trials = trials_of("usv", ("zigzag",) * len(sizes), 30.0, 3, (), validate=0)
    return [
        replace(t, measurements=t.measurements | {"position": replace(
            t.measurements["position"], wander=size, correlation_time=60.0 if size else 0.0)})
        for t, size in zip(trials, sizes, strict=True)
    ]  # fmt: skip


def test_a_receiver_that_wanders_in_two_logs_wanders_in_all():
    pooled = with_pooled_noise(wandering_trials((0.0, 0.4, 0.6, 0.0)))
    assert [t.measurements["position"].wander for t in pooled] == pytest.approx([np.sqrt(0.26)] * 4)


def test_one_log_of_many_says_nothing_of_the_others():
    pooled = with_pooled_noise(wandering_trials((0.0, 0.4, 0.0, 0.0)))
    assert {t.measurements["position"].wander for t in pooled} == {0.0}


def test_a_known_drift_keeps_its_share_where_weights_change():
    _, problem = drifting_problem()
    stretch = problem.stretches[0]
    twice = stretch.weighted(2.0 * stretch.samples.sigma, np.full(4, 2.0))
    assert twice.drifts == (Drift(1.0, 40.0),)


@pytest.mark.slow
def test_a_drift_is_noise_and_not_structure_that_the_model_lacks():
    wandering = replace(Suite(), position=Sensor(5.0, 0.02, 0.004, wander=0.5, wander_time=30.0))
    chi2 = []
    for told in (True, False):
        ship, trials = trials_of("usv", ("zigzag", "random", "circle"), 60.0, 3, (), suite=wandering)
        size = {"wander": 0.5, "correlation_time": 30.0} if told else {}
        trials = [
            replace(
                t, measurements=t.measurements | {"position": replace(t.measurements["position"], **size)}
            )
            for t in trials
        ]
        prepared = prepare(trials, ship.model)
        chi2.append(fit_from_scratch(prepared.structure, prepared.identify, rounds=1))
    told, untold = chi2
    assert told.chi2_per_dof == pytest.approx(1.0, abs=0.1)
    assert float(told.problem.dispersed.inflation.max()) < 1.3
    assert float(untold.problem.dispersed.inflation.max()) > 2.0


def test_a_drift_of_next_to_nothing_is_not_counted():
    pooled = with_pooled_noise(wandering_trials((0.005, 0.005)))
    assert {t.measurements["position"].wander for t in pooled} == {0.0}
