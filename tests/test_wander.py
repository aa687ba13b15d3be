"""A position that drifts: told from what the fit leaves of it, and counted in the standard errors."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from identification_samples import trials_of
from scipy.signal import lfilter

from identify.base_fit import window_length
from identify.first_states import first_states
from identify.fitted import Fitted
from identify.kernel import POSITION
from identify.noise import calibrated
from identify.output_error import solve
from identify.parameter_covariance import covariance_of
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.wander import Reduction, moved_by_wander
from identify.windows import cut

TIME = 15.0


@cache
def fitted():
    prepared = prepare(trials_of("catamaran", ("zigzag", "random", "zigzag10"), 60.0, 5)[1], "modulus")
    return fit_declared(prepared)


def drifting(size, seed):
    """The same logs with positions that drift as a satellite receiver's do, fitted again."""
    found, rng = fitted(), np.random.default_rng(seed)
    stretches = tuple(replace(s, samples=drifted(s.samples, size, rng)) for s in found.problem.stretches)
    structure = found.solution.structure
    problem = cut(stretches, window_length(structure.vessel.length)).weighted_as(found.problem)
    solution = solve(problem, structure, found.solution.p, first_states(problem), found.prior, budget=8)
    for _ in range(2):
        problem = calibrated(problem, solution)
        solution = solve(problem, structure, solution.p, solution.first, found.prior, budget=5)
    return Fitted(problem, found.prior, solution)


def drifted(samples, size, rng):
    mine = samples.kind == POSITION
    keep = np.exp(-np.median(np.diff(samples.t[mine])) / TIME)
    steps = rng.standard_normal((mine.sum(), 2)) * np.sqrt(1.0 - keep**2)
    steps[0] /= np.sqrt(1.0 - keep**2)
    value = samples.value.copy()
    value[mine] += size * samples.sigma[mine, None] * lfilter([1.0], [1.0, -keep], steps, axis=0)
    return replace(samples, value=value)


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
