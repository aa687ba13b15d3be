"""A position that drifts: told from what the fit leaves of it, and counted in the standard errors."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from drifting_samples import fitted_to_drifts, fitted_to_swings
from identification_samples import trials_of

from identify.drift import Drift
from identify.kernel import POSITION
from identify.parameter_covariance import covariance_of, reduction_of
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.report_fit import wander_words
from identify.wander import Reduction, in_wander, likeliest_wander, moved_by_wander, wander_shown
from validate.other_logs import on_other_logs
from validate.wander import with_wander_anew, with_wander_known

TIME = 15.0


@cache
def fitted():
    prepared = prepare(trials_of("catamaran", ("zigzag", "random", "zigzag10"), 60.0, 5)[1], "modulus")
    return fit_declared(prepared)


def drifting(size, seed):
    """The same logs with positions that drift as a satellite receiver's do, fitted again."""
    return fitted_to_drifts(fitted(), POSITION, size, TIME, seed)


def coefficients(found):
    return [k for k, s in enumerate(found.solution.structure.slots) if s.coefficient >= 0]


def test_white_noise_is_no_drift():
    found = fitted()
    n = len(found.solution.p)
    nothing = Reduction(
        np.zeros((len(found.problem.windows), 8, 8)),
        np.zeros((len(found.problem.windows), 8 + n, n)),
        np.eye(n),
    )
    assert moved_by_wander(found.problem, found.solution, nothing) is None


def test_a_drift_widens_the_standard_errors_to_what_it_does():
    """Over draws the parameters are off by as much as is said; counted as white they would be off by much more."""
    truth, ratios = fitted().solution.p, []
    for seed in range(4):
        found = drifting(3.0, seed)
        k = coefficients(found)
        ratios.append((found.solution.p - truth)[k] / np.sqrt(np.diag(covariance_of(found))[k]))
    size = float(
        np.sqrt(np.median(np.square(ratios)) / 0.455)
    )  # 0.455: median of χ² with one degree of freedom
    assert 0.5 < size < 1.6


def test_the_larger_the_drift_the_wider_the_intervals():
    small, large = (np.sqrt(np.diag(covariance_of(drifting(s, 1)))) for s in (1.0, 5.0))
    k = coefficients(fitted())
    assert np.median(large[k] / small[k]) > 1.5


def test_a_drift_shows():
    found = drifting(4.0, 2)
    n, w = len(found.solution.p), len(found.problem.windows)
    free = Reduction(np.zeros((w, 8, 8)), np.zeros((w, 8 + n, n)), np.eye(n))
    assert moved_by_wander(found.problem, found.solution, free) is not None


def noise(found):
    """Standard deviation of the white part of the positions, m."""
    samples = found.problem.stretches[0].samples
    return np.median(samples.sigma[samples.kind == POSITION])


def slow(found):
    return found.problem.dispersed.inflation[POSITION]


def test_what_white_noise_leaves_is_as_it_was():
    assert with_wander_known(fitted()) is fitted()
    assert with_wander_anew(fitted()) is fitted()


def test_a_drift_that_shows_is_known_with_its_size_and_leaves_the_noise():
    without = drifting(6.0, 4)
    found = with_wander_known(without)
    drift = wander_shown(found.problem)
    told, true = drift.size / np.sqrt(drift.time), 6.0 * noise(fitted()) / np.sqrt(TIME)
    assert 0.6 < told / true < 1.6
    assert slow(without) > 5.0 > 1.4 > slow(found)
    assert found.chi2_per_dof < 1.1


def test_what_moves_a_position_evenly_is_no_drift_of_its_receiver():
    """A current that turns with the tide does, however likely the errors are with a drift."""
    found = fitted_to_swings(fitted(), POSITION, 6.0, 40.0, 1)
    assert slow(found) > 5.0
    assert likeliest_wander(found.problem, found.solution, reduction_of(found)) is not None
    assert with_wander_known(found) is found


def test_parameters_are_nearer_with_a_drift_that_is_known():
    """Over draws: what the fit would follow of the drift it leaves alone."""
    truth, k = fitted().solution.p, coefficients(fitted())
    deviation = np.sqrt(np.diag(covariance_of(fitted())))[k]
    off = [
        [
            np.sqrt(np.mean(((f.solution.p - truth)[k] / deviation) ** 2))
            for f in (found, with_wander_known(found))
        ]
        for found in (drifting(6.0, seed) for seed in range(4))
    ]
    without, known = np.median(off, axis=0)
    assert known < 0.9 * without


def test_a_drift_is_told_anew_where_what_was_missing_was_part_of_it():
    truth = with_wander_known(drifting(6.0, 4))
    drift = wander_shown(truth.problem)
    wrong = in_wander(truth.problem, replace(drift, size=8.0 * drift.size))
    again = with_wander_anew(replace(truth, problem=replace(truth.problem, stretches=wrong)))
    assert 0.6 < wander_shown(again.problem).size / drift.size < 1.7


def test_what_moves_a_position_evenly_is_not_told_as_more_of_a_drift_that_is_known():
    found = fitted_to_swings(fitted(), POSITION, 6.0, 40.0, 1)
    drift = Drift(noise(fitted()), TIME, POSITION, shown=True)
    known = replace(found, problem=replace(found.problem, stretches=in_wander(found.problem, drift)))
    assert with_wander_anew(known) is known


def test_a_drift_that_is_no_more_is_forgotten():
    found = fitted()
    known = replace(
        found,
        problem=replace(found.problem, stretches=in_wander(found.problem, Drift(0.05, 20.0, shown=True))),
    )
    again = with_wander_anew(known)
    assert wander_shown(again.problem) is None
    assert again.chi2_per_dof < 1.1


def test_other_logs_of_the_same_receiver_drift_as_well():
    found = with_wander_known(drifting(6.0, 4))
    bare = in_wander(found.problem, None)[:1]
    other = on_other_logs(found, bare)
    assert wander_shown(other.problem) is not None


def test_the_report_says_how_far_positions_wander():
    (said,) = wander_words(Drift(0.10, 20.0, shown=True))
    assert "0.12 m in 30 s" in said
    assert wander_words(None) == []
