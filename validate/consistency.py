"""Whether a gain comes from all over the data, or from a few places where errors happen to be large."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.fitted import Fitted
from identify.settled import settled
from identify.windows import Problem, Window

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Above this ratio errors count as not white; the gain must then exceed so many times its scatter over bins of so
#: many s.
WHITE, SCATTER, BIN = 1.2, 2.5, 5.0
#: ... or so many times, where the errors left in those that gain are on average less than so many times the others'.
SCATTER_RIGHT, RIGHT = 1.5, 1.1


def consistent(base: Fitted, fit: Fitted) -> bool:
    """Whether the gain comes from all over the data, not from a few places where errors happen to be large.

    Where the errors are white, the likelihood alone is right. Where they are not, the gain is summed over short
    stretches of time and must stand out against its own scatter between them; less so where the effect leaves those
    that it gains from like all others: a load shows in the few in which a vessel turns hard, and nothing else makes
    these right.
    """
    if float(np.max(base.problem.dispersed.inflation)) < WHITE:
        return True
    gains = gains_by_time(base, fit)
    return stands_out(gains) or (stands_out(gains, SCATTER_RIGHT) and _puts_right(base, fit, gains))


def _puts_right(base: Fitted, fit: Fitted, gains: FloatArray) -> bool:
    """Whether the stretches of time that gain are left with no larger errors than the others."""
    left = by_time(_under_weights_of(base, fit)) / np.maximum(_samples_by_time(base), 1.0)
    return bool(np.average(left, weights=np.maximum(gains, 0.0) + 1e-12) < RIGHT * left.mean())


def gains_by_time(base: Fitted, fit: Fitted) -> FloatArray:
    """Gain of short stretches of time (bins,), under the base's weights."""
    return by_time(base) - by_time(_under_weights_of(base, fit))


def _under_weights_of(base: Fitted, fit: Fitted) -> Fitted:
    """A fit's parameters in the windows of a base, with its weights."""
    if fit.problem is base.problem:
        return fit
    there = settled(base.problem, fit.solution.structure, fit.solution.p)
    solution = replace(fit.solution, first=there.first, moments=there.moments)
    return replace(fit, problem=base.problem, solution=solution)


def stands_out(gains: FloatArray, times: float = SCATTER) -> bool:
    """Whether a sum is so many times the scatter of its parts."""
    return bool(gains.sum() > times * np.sqrt(len(gains)) * gains.std(ddof=1))


def by_time(fitted: Fitted) -> FloatArray:
    """Cost of short stretches of time (bins,), as dispersed."""
    problem, out = fitted.problem, []
    for w, residual in zip(problem.windows, fitted.solution.moments.residuals, strict=True):
        weight = 1.0 / problem.dispersion[problem.kinds(w)] ** 2
        out.append(np.bincount(_bins(problem, w), weights=np.sum(residual**2, axis=1) * weight))
    return np.concatenate(out)


def _samples_by_time(fitted: Fitted) -> FloatArray:
    """Number of samples of the same stretches of time (bins,)."""
    problem = fitted.problem
    return np.concatenate([np.bincount(_bins(problem, w)).astype(float) for w in problem.windows])


def _bins(problem: Problem, window: Window) -> IntArray:
    """Number of the short stretch of time in which each sample (m,) of a window was taken."""
    t = problem.stretches[window.stretch].samples.taken[window.samples]
    return np.asarray(np.floor((t - t[0]) / BIN), dtype=np.int64)
