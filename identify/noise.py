"""The noise that is really there: from the prediction errors themselves.

White noise shows in the differences of neighbouring errors, whatever the model lacks; what the errors have beyond it
at low frequency is structure or correlated noise. A stream's errors are then given the weight of their spectral
density at low frequency, so that a slow error does not count as many independent ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.fft import next_fast_len

from identify import kernel
from identify.moments import Moments
from identify.output_error import Solution
from identify.settled import Settled
from identify.stretch import Stretch
from identify.unlogged import most_likely
from identify.windows import Problem

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Times (m,) and errors (m, axes) of one stream in every window that it has samples in.
Errors = Sequence[tuple[FloatArray, FloatArray]]

#: Axes of position, heading, yaw rate and velocity; so few samples of one in a window say nothing.
AXES, FEW = (2, 1, 1, 2), 8
#: A lone error of more than this many times the stream's own size is an outlier; its σ is multiplied by ``ASIDE``.
WILD, ASIDE = 7.0, 1e4
#: Time lags at which errors are told smooth from rough, in steps of the integration: longer aboard what answers slowly.
SMOOTH_LAGS = (15.0, 45.0)
#: Autocorrelation is summed over at most so many steps.
MEMORY = 80.0


def errors_by_stream(problem: Problem, moments: Moments) -> tuple[Errors, ...]:
    """Per stream, in the order of their kinds, its errors in every window, in units of its weight."""
    found: tuple[list[tuple[FloatArray, FloatArray]], ...] = tuple([] for _ in AXES)
    for w, residual in zip(problem.windows, moments.residuals, strict=True):
        samples = problem.stretches[w.stretch].samples
        t, kind = samples.t[w.samples], samples.kind[w.samples]
        for k, axes in enumerate(AXES):
            mine = np.flatnonzero(kind == k)
            if len(mine) > FEW:
                found[k].append((t[mine], residual[mine, :axes]))
    return tuple(found)


def white_ratio(errors: Errors) -> float:
    """σ of the white part of a stream's errors over the σ that they were weighted with (robust against outliers)."""
    if not errors:
        return 1.0
    d = np.concatenate([np.diff(e, axis=0).ravel() for _, e in errors])
    limit = 4.0 * 1.4826 * float(np.median(np.abs(d))) + 1e-12
    inside = np.abs(d) <= limit
    return float(np.sqrt(np.mean(d[inside] ** 2) / 2.0))


def low_frequency_ratio(errors: Errors, h: float) -> float:
    """Standard deviation that a slow average of the errors has, over that which white noise of weight 1 would give.

    The autocovariance is summed until it has died out (initial positive sequence), at most over ``MEMORY`` steps ``h``.
    """
    if not errors:
        return 1.0
    n = sum(e.size for _, e in errors)
    interval = float(np.median(np.concatenate([np.diff(t) for t, _ in errors])))
    lags = max(2, min(int(MEMORY * h / max(interval, 1e-3)), min(len(e) for _, e in errors) // 2))
    covariance = _autocovariance([c for _, e in errors for c in e.T], lags) / n
    noise = 2.0 * covariance[0] / np.sqrt(n)
    died = np.nonzero(covariance[1:] < noise)[0]
    last = 1 + (int(died[0]) if len(died) else lags - 1)
    return float(np.sqrt(max(covariance[0] + 2.0 * covariance[1:last].sum(), 0.0)))


def _autocovariance(series: Sequence[FloatArray], lags: int) -> FloatArray:
    """Sums (lags,) of products of each series with itself so many samples later, none across their ends."""
    apart = np.concatenate([np.concatenate([s, np.zeros(lags)]) for s in series])
    spectrum = np.fft.rfft(apart, next_fast_len(len(apart)))
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2, next_fast_len(len(apart)))[:lags], dtype=float)


def smoothness(problem: Problem, moments: Moments, kind: int) -> float:
    """How smooth the slow part of a stream's errors is: 1 as the answer to a force, 0 as a random walk or noise.

    The increments' variance, white noise taken off, grows with the lag to the power 2 for a smooth error and with the
    power 1 for a wander (first-order Gauss-Markov noise). The power is taken one standard error low (jackknife over
    windows), since few windows of a slow error tell little.
    """
    h, errors = problem.stretches[0].h, errors_by_stream(problem, moments)[kind]
    sums = [_increments(errors, lag * h) for lag in SMOOTH_LAGS]
    white = 2.0 * white_ratio(errors) ** 2
    if any(len(s) == 0 for s in sums) or len(sums[0]) != len(sums[1]):
        return 0.0
    totals = np.array([s.sum(axis=0) for s in sums])
    power = _power(totals, white)
    n = len(sums[0])
    if power is None or n < 2:
        return 0.0
    without = [_power(totals - np.array([s[k] for s in sums]), white) for k in range(n)]
    known = np.array([p for p in without if p is not None])
    error = float(np.sqrt((n - 1) * np.var(known))) if len(known) > 1 else 0.0
    return float(np.clip(1.5 * (power - error - 1.1), 0.0, 1.0))


def beyond_drift(problem: Problem, moments: Moments, kind: int, smoothed: bool = False) -> float:
    """Part of the slow variance of a kind's errors that a drift of it which is known is too small for; 0 without one.

    Less a drift that is known, whatever is slow looks like a drift. Where windows begin as ``smoothed`` motion does,
    the errors of its velocities, which the drift has made, add up.
    """
    slow = known = 0.0
    axes, rates = (2, slice(0, 2)) if kind == kernel.POSITION else (1, slice(2, 3))
    for w, raw in zip(problem.windows, moments.raw, strict=True):
        stretch, mine = problem.stretches[w.stretch], problem.kinds(w) == kind
        drift = next((d for d in stretch.drifts if d.kind == kind), None)
        if drift is None:
            continue
        weight = stretch.samples.sigma[w.samples][mine] ** -2.0
        since = stretch.samples.t[w.samples][mine] - stretch.start - stretch.h * w.first
        begun = float(np.sum(stretch.sigmas[w.first, rates] ** 2)) if smoothed else 0.0
        slow += float(np.sum(raw[mine][:, :axes] ** 2 - 1.0))
        known += float(np.sum(weight * (axes * drift.size**2 + begun * since**2)))
    return float(np.clip(1.0 - known / slow, 0.0, 1.0)) if slow > 0.0 else 0.0


def _power(totals: FloatArray, white: float) -> float | None:
    """Power of the lag with which increments grow, from (sum of squares, count) at two; None where all is white.

    The short ones are taken as large as white noise allows by a standard error: in a noisy stream they are little else,
    and where it made them small by chance, any wander would seem to grow fast.
    """
    count = np.maximum(totals[:, 1], 1.0)
    short, long = totals[:, 0] / count - white
    if long <= 0.05 * white:
        return None
    growth = long / max(short + white * float(np.sqrt(3.0 / count[0])), 1e-3 * white)
    return float(np.log(growth) / np.log(SMOOTH_LAGS[1] / SMOOTH_LAGS[0]))


def _increments(errors: Errors, lag: float) -> FloatArray:
    """Sum of squared increments of the errors over a time lag, s, and their count, per window (w, 2)."""
    found = []
    for t, e in errors:
        k = max(1, round(lag / float(np.median(np.diff(t)))))
        if len(e) > 2 * k:
            step = e[k:] - e[:-k]
            found.append((float(np.sum(step**2)), float(step.size)))
    return np.array(found)


def size_ratio(errors: Errors) -> float:
    """Root mean square of a stream's errors, over the σ that they were weighted with."""
    if not errors:
        return 1.0
    return float(np.sqrt(sum(np.sum(e**2) for _, e in errors) / sum(e.size for _, e in errors)))


def calibrated(problem: Problem, solution: Solution | Settled) -> Problem:
    """The problem with every stream's σ from its own errors, its inflation by their size, and their dispersion.

    What the inputs hide between their samples stays as it is.
    """
    bare = replace(problem, inflation=np.ones(4))
    seen, h = _bare(problem, bare, solution.moments), problem.stretches[0].h
    each = errors_by_stream(bare, seen)
    white, size, slow = np.array([(white_ratio(e), size_ratio(e), low_frequency_ratio(e, h)) for e in each]).T
    white = np.maximum(white, 1e-6)
    inflation = np.maximum(size / white, 1.0)
    dispersion = np.maximum(slow / (white * inflation), 1.0)
    wild = wild_samples(bare, seen, inflation * white)
    stretches = tuple(_scaled(s, white, wild.get(k)) for k, s in enumerate(problem.stretches))
    return replace(bare, stretches=stretches, inflation=inflation, dispersion=dispersion)


def calibrated_anew(problem: Problem, solution: Solution | Settled, fine: bool = True) -> Problem:
    """``calibrated``, and what the inputs hide between their samples as the errors are most likely with.

    Unless it is to be ``fine``, inputs that are logged often are taken to hide nothing: a fit that grows needs no more.
    """
    found = calibrated(replace(problem, unlogged=None), solution)
    bare = replace(found, inflation=np.ones(4))
    ratio = [
        a.samples.sigma / b.samples.sigma for a, b in zip(problem.stretches, found.stretches, strict=True)
    ]
    raw = [
        e * (problem.inflation[problem.kinds(w)] * ratio[w.stretch][w.samples])[:, None]
        for w, e in zip(problem.windows, solution.moments.raw, strict=True)
    ]
    known = most_likely(bare, solution.structure, solution.p, raw, fine, problem.pushes)
    return found if known is None else calibrated(replace(problem, unlogged=known), solution)


def recalibrated(problem: Problem, solution: Solution | Settled) -> Problem:
    """``calibrated``; where inputs hide something, as the solution now answers to it."""
    return (calibrated if problem.unlogged is None else calibrated_anew)(problem, solution)


def _bare(problem: Problem, bare: Problem, moments: Moments) -> Moments:
    """Errors in units of the sensors' σ, white as far as ``bare`` says what its inputs hide."""
    return replace(moments, raw=in_noise(problem, moments), white=bare.white)


def in_noise(problem: Problem, moments: Moments) -> tuple[FloatArray, ...]:
    """Errors (m, 2) of every window in units of the sensors' σ."""
    each = zip(problem.windows, moments.raw, strict=True)
    return tuple(e * problem.inflation[problem.kinds(w)][:, None] for w, e in each)


def wild_samples(problem: Problem, moments: Moments, size: FloatArray) -> dict[int, FloatArray]:
    """Per stretch: times of lone samples that no model near the noise can explain (outliers that came through)."""
    found: dict[int, list[FloatArray]] = {}
    for w, residual in zip(problem.windows, moments.residuals, strict=True):
        samples = problem.stretches[w.stretch].samples
        kind = samples.kind[w.samples]
        scale = np.maximum(size[kind] / problem.inflation[kind], 1e-9)
        if not np.any(np.abs(residual) > WILD * scale[:, None]):
            continue
        for k in np.unique(kind):
            mine = np.nonzero(kind == k)[0]
            error = np.abs(residual[mine]).max(axis=1) / scale[mine]
            around = np.maximum(np.roll(error, 1), np.roll(error, -1))
            lone = (error > WILD) & (error > 2.0 * around)
            if lone.any() and lone.mean() < 0.05:
                found.setdefault(w.stretch, []).append(w.samples.start + mine[lone])
    return {k: np.concatenate(v) for k, v in found.items()}


def dispersed_cost(problem: Problem, solution: Solution) -> float:
    """Cost, errors counted as they are at low frequency, priors included; infinite where there is no solution."""
    if not np.isfinite(solution.cost):
        return np.inf
    total = solution.penalty
    for w, residual in zip(problem.windows, solution.moments.residuals, strict=True):
        kind = problem.stretches[w.stretch].samples.kind[w.samples]
        total += float(np.sum(residual**2 / (problem.dispersion[kind] ** 2)[:, None]))
    return total


def _scaled(stretch: Stretch, factor: FloatArray, wild: FloatArray | None = None) -> Stretch:
    samples = stretch.samples
    sigma = samples.sigma * factor[samples.kind]
    if wild is not None:
        sigma[wild] *= ASIDE
    return stretch.weighted(sigma, factor)
