"""The noise that is really there: from the prediction errors themselves.

White noise shows in the differences of neighbouring errors, whatever the model lacks; what the errors have beyond it
at low frequency is structure or correlated noise. A stream's errors are then given the weight of their spectral
density at low frequency, so that a slow error does not count as many independent ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from identify import kernel
from identify.output_error import Solution
from identify.stretch import Stretch
from identify.windows import Moments, Problem

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Autocorrelation is summed over at most this time, s.
MEMORY = 8.0


def errors_by_stream(problem: Problem, moments: Moments, kind: int) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Per window: times (m,) and errors (m, rows) of one stream, in units of its weight."""
    for w, residual in zip(problem.windows, moments.residuals, strict=True):
        samples = problem.stretches[w.stretch].samples
        mine = samples.kind[w.samples] == kind
        rows = 2 if kind in (kernel.POSITION, kernel.VELOCITY) else 1
        if mine.sum() > 8:
            yield samples.t[w.samples][mine], residual[mine, :rows]


def white_ratio(problem: Problem, moments: Moments, kind: int) -> float:
    """σ of the white part of a stream's errors over the σ that they were weighted with (robust against outliers)."""
    steps = [np.diff(e, axis=0).ravel() for _, e in errors_by_stream(problem, moments, kind)]
    if not steps:
        return 1.0
    d = np.concatenate(steps)
    limit = 4.0 * 1.4826 * float(np.median(np.abs(d))) + 1e-12
    inside = np.abs(d) <= limit
    return float(np.sqrt(np.mean(d[inside] ** 2) / 2.0))


def low_frequency_ratio(problem: Problem, moments: Moments, kind: int) -> float:
    """Standard deviation that a slow average of the errors has, over that which white noise of weight 1 would give.

    The autocovariance is summed until it has died out (initial positive sequence), at most over ``MEMORY``.
    """
    errors = list(errors_by_stream(problem, moments, kind))
    if not errors:
        return 1.0
    n = sum(e.size for _, e in errors)
    interval = float(np.median(np.concatenate([np.diff(t) for t, _ in errors])))
    lags = max(2, min(int(MEMORY / max(interval, 1e-3)), min(len(e) for _, e in errors) // 2))
    covariance = np.array([sum(float(np.sum(e[k:] * e[: len(e) - k])) for _, e in errors) for k in range(lags)]) / n
    noise = 2.0 * covariance[0] / np.sqrt(n)
    died = np.nonzero(covariance[1:] < noise)[0]
    last = 1 + (int(died[0]) if len(died) else lags - 1)
    return float(np.sqrt(max(covariance[0] + 2.0 * covariance[1:last].sum(), 0.0)))


def size_ratio(problem: Problem, moments: Moments, kind: int) -> float:
    """Root mean square of a stream's errors, over the σ that they were weighted with."""
    errors = [e for _, e in errors_by_stream(problem, moments, kind)]
    return float(np.sqrt(sum(np.sum(e**2) for e in errors) / sum(e.size for e in errors))) if errors else 1.0


def calibrated(problem: Problem, solution: Solution) -> Problem:
    """The problem with every stream's σ from its own errors, its inflation by their size, and their dispersion."""
    found = [
        [ratio(problem, solution.moments, k) for k in range(4)] for ratio in (white_ratio, size_ratio, low_frequency_ratio)
    ]
    white, size, slow = np.array(found) * problem.inflation
    white = np.maximum(white, 1e-6)
    inflation = np.maximum(size / white, 1.0)
    dispersion = np.maximum(slow / (white * inflation), 1.0)
    stretches = tuple(_scaled(s, white) for s in problem.stretches)
    return replace(problem, stretches=stretches, inflation=inflation, dispersion=dispersion)


def dispersed_cost(problem: Problem, solution: Solution) -> float:
    """Cost with every stream's errors counted as they are at low frequency, priors included."""
    total = solution.penalty
    for w, residual in zip(problem.windows, solution.moments.residuals, strict=True):
        kind = problem.stretches[w.stretch].samples.kind[w.samples]
        total += float(np.sum(residual**2 / (problem.dispersion[kind] ** 2)[:, None]))
    return total


def _scaled(stretch: Stretch, factor: FloatArray) -> Stretch:
    samples = stretch.samples
    return replace(stretch, samples=replace(samples, sigma=samples.sigma * factor[samples.kind]))
