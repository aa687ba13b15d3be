"""Fits to logs one of whose sensors drifts, as first-order Gauss-Markov noise does."""

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from identify.base_fit import window_length
from identify.first_states import first_states
from identify.fitted import Fitted
from identify.noise import calibrated
from identify.output_error import solve
from identify.windows import cut


def fitted_to_drifts(found, kind, size, time, seed):
    """A fit begun at another, to its logs with a sensor that drifts by so many times its noise over a time, s."""
    rng = np.random.default_rng(seed)
    return fitted_to(found, lambda samples: drifted(samples, kind, size, time, rng))


def fitted_to_swings(found, kind, size, period, seed):
    """The same to logs with a sensor that goes to and fro by so many times its noise in a period, s."""
    rng = np.random.default_rng(seed)
    return fitted_to(found, lambda samples: swung(samples, kind, size, period, rng))


def fitted_to(found, other):
    """A fit begun at another, to its logs with ``other`` samples."""
    stretches = tuple(replace(s, samples=other(s.samples)) for s in found.problem.stretches)
    structure = found.solution.structure
    problem = cut(stretches, window_length(structure.vessel.length)).weighted_as(found.problem)
    solution = solve(problem, structure, found.solution.p, first_states(problem), found.prior, budget=8)
    for _ in range(2):
        problem = calibrated(problem, solution)
        solution = solve(problem, structure, solution.p, solution.first, found.prior, budget=5)
    return Fitted(problem, found.prior, solution)


def swung(samples, kind, size, period, rng):
    mine = samples.kind == kind
    phase = 2.0 * np.pi * samples.t[mine, None] / period + rng.uniform(0.0, 2.0 * np.pi, 2)
    value = samples.value.copy()
    value[mine] += size * samples.sigma[mine, None] * np.sin(phase)
    return replace(samples, value=value)


def drifted(samples, kind, size, time, rng):
    mine, axes = samples.kind == kind, 2 if samples.value[samples.kind == kind, 1].any() else 1
    keep = np.exp(-np.median(np.diff(samples.t[mine])) / time)
    steps = rng.standard_normal((mine.sum(), axes)) * np.sqrt(1.0 - keep**2)
    steps[0] /= np.sqrt(1.0 - keep**2)
    value = samples.value.copy()
    value[mine, :axes] += size * samples.sigma[mine, None] * lfilter([1.0], [1.0, -keep], steps, axis=0)
    return replace(samples, value=value)
