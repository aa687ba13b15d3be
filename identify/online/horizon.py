"""A moving horizon of windows: the output error of the recent ones, the information of all before.

The cost is that of `identify.output_error`, so that the end agrees with a fit off line. Windows that leave the horizon
leave their normal equations behind (first states eliminated, linearised where the parameters were when they left); the
others are linearised anew whenever the parameters move. Old information is forgotten exponentially. Cost and memory per
window are bounded by the horizon's length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from identify.first_states import first_states, state_precision
from identify.kernel import NX
from identify.moments import Moments
from identify.noise import calibrated
from identify.online.knowledge import Estimate, Knowledge, Noise
from identify.output_error import Prior, Solution, Stopped
from identify.reduction import Reduced, damped_step, reduce
from identify.stretch import Stretch
from identify.structure import Structure
from identify.windows import Problem, Window, moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Windows that are kept and linearised anew.
MOST_WINDOWS = 20
#: Steps of the search per update, and the gain in cost below which it stops.
MOST_STEPS, ENOUGH = 6, 0.05


@dataclass(frozen=True)
class Horizon:
    """Where the estimate stands.

    Attributes
    ----------
    structure : Structure
    prior : Prior
        What is known beforehand; never forgotten.
    p : (np,)
    noise : Noise
    past : Knowledge
    windows : tuple of Stretch
        The recent ones, one window each.
    first : (w, 8)
        Their first states.
    forget : float
        Time constant of forgetting, s.
    """

    structure: Structure
    prior: Prior
    p: FloatArray
    noise: Noise
    past: Knowledge
    windows: tuple[Stretch, ...] = ()
    first: FloatArray = field(default_factory=lambda: np.zeros((0, NX)))
    forget: float = math.inf


def duration(stretch: Stretch) -> float:
    """Length of a window, s."""
    return stretch.steps * stretch.h


def problem_of(windows: tuple[Stretch, ...], noise: Noise) -> Problem:
    """Windows as a problem, one window per stretch."""
    cut = tuple(Window(k, 0, s.steps, slice(0, len(s.samples.t))) for k, s in enumerate(windows))
    longest = max((duration(s) for s in windows), default=0.0)
    return Problem(windows, cut, noise.inflation, noise.dispersion, longest)


def with_noise(stretch: Stretch, noise: Noise) -> Stretch:
    """The stretch with the σ of its samples set by their stream."""
    samples = stretch.samples
    return replace(stretch, samples=replace(samples, sigma=noise.sigma[samples.kind]))


def newest(horizon: Horizon) -> float:
    """Time at which the newest window ends, s."""
    return max((s.start + duration(s) for s in horizon.windows), default=horizon.past.at)


def ages(horizon: Horizon, now: float) -> FloatArray:
    """Weight (w,) that forgetting leaves to each window."""
    ends = np.array([s.start + duration(s) for s in horizon.windows])
    return np.exp(-np.maximum(now - ends, 0.0) / horizon.forget)


def update(horizon: Horizon, stretch: Stretch | None, *, keep: bool = True) -> tuple[Horizon, Solution]:
    """Take one more window into account and search from where the parameters are.

    ``keep`` puts the window into the horizon; otherwise it only counts in what is returned (a window that is not
    complete yet).

    Returns
    -------
    horizon : Horizon
        With the new parameters.
    solution : Solution
        Of all windows of the horizon, and this one last.
    """
    full = horizon if stretch is None else with_window(horizon, stretch)
    now = newest(full)
    solution = _search(replace(full, past=full.past.later(now, full.forget)), ages(full, now))
    if stretch is not None and not keep:
        return replace(horizon, p=solution.p, first=solution.first[: len(horizon.windows)]), solution
    return replace(full, p=solution.p, first=solution.first), solution


def with_window(horizon: Horizon, stretch: Stretch) -> Horizon:
    """The horizon with one more window, before any search."""
    window = (with_noise(stretch, horizon.noise),)
    first = fitted_firsts(horizon.structure, horizon.p, window, horizon.noise)
    return replace(horizon, windows=(*horizon.windows, *window), first=np.concatenate([horizon.first, first]))


def _current(structure: Structure, p: FloatArray) -> FloatArray:
    found = np.zeros(2)
    for e, active in enumerate(structure.actives):
        if active.effect.current:
            found = found + np.array(active.effect.current(structure.values(p, e)))
    return found


@dataclass(frozen=True)
class _Point:
    """Parameters, first states, and the moments and cost there."""

    p: FloatArray
    first: FloatArray
    moments: Moments
    cost: float


def _search(horizon: Horizon, weight: FloatArray) -> Solution:
    """Damped Gauss-Newton; see `identify.output_error.solve`."""
    structure, anchor = horizon.structure, horizon.first
    known = state_precision(structure)
    problem = problem_of(horizon.windows, horizon.noise)
    low, high = (np.array([s.parameter.bounds[k] for s in structure.slots]) for k in (0, 1))

    def at(p: FloatArray, first: FloatArray) -> _Point:
        found = moments(problem, structure, p, first)
        states = np.sum((first - anchor) ** 2 * known, axis=1)
        cost = float(weight @ (found.matrices[:, -1, -1] + states))
        return _Point(p, first, found, cost + _known_cost(horizon, p))

    here, damping, steps, stopped = at(np.clip(horizon.p, low, high), anchor), 1e-3, 0, Stopped.BUDGET
    held = np.zeros(len(here.p), dtype=bool)
    while steps < MOST_STEPS:
        steps += 1
        if not np.isfinite(here.cost):
            stopped = Stopped.DIVERGED
            break
        reduced = reduce(here.moments.matrices, here.first, anchor, known, damping)
        information, score = _normal(horizon, reduced, weight, here.p)
        held = ((here.p <= low) & (score < 0)) | ((here.p >= high) & (score > 0))
        move = damped_step(information, score, ~held, damping)
        first = here.first + reduced.state_step - np.einsum("wij,j->wi", reduced.state_slope, move)
        there = at(np.clip(here.p + move, low, high), first)
        gain = here.cost - there.cost
        if np.isfinite(there.cost) and gain >= 0.0:
            here, damping = there, max(0.1 * damping, 1e-7)
            if gain < ENOUGH:
                stopped = Stopped.CONVERGED
                break
        else:
            damping = 10.0 * max(damping, 1e-4)
    reduced = reduce(np.nan_to_num(here.moments.matrices), here.first, anchor, known)
    return Solution(
        structure, here.p, here.first, here.cost, 0.0, reduced, here.moments, held, stopped, steps
    )


def _known_cost(horizon: Horizon, p: FloatArray) -> float:
    past, prior = horizon.past, horizon.prior
    return float(
        p @ past.information @ p - 2.0 * past.vector @ p + np.sum(((p - prior.mean) / prior.sd) ** 2)
    )


def _normal(
    horizon: Horizon, reduced: Reduced, weight: FloatArray, p: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Information and score of everything that is known, at ``p``."""
    past, prior = horizon.past, horizon.prior
    information = np.einsum("w,wij->ij", weight, reduced.information) + past.information
    score = weight @ reduced.score + past.vector - past.information @ p - (p - prior.mean) / prior.sd**2
    return information + np.diag(1.0 / prior.sd**2), score


def promised(horizon: Horizon) -> float:
    """Cost that the next step promises; infinite where the prediction runs away."""
    structure, first = horizon.structure, horizon.first
    found = moments(problem_of(horizon.windows, horizon.noise), structure, horizon.p, first)
    if not np.isfinite(found.cost):
        return math.inf
    reduced = reduce(found.matrices, first, first, state_precision(structure))
    information, score = _normal(horizon, reduced, np.ones(len(first)), horizon.p)
    move = damped_step(information, score, np.ones(len(score), dtype=bool), 1e-9)
    return float(reduced.cost.sum()) + _known_cost(horizon, horizon.p) - float(score @ move)


def fitted_firsts(
    structure: Structure, p: FloatArray, windows: tuple[Stretch, ...], noise: Noise
) -> FloatArray:
    """First states (w, 8) with the parameters held: three Gauss-Newton steps from what was observed."""
    problem = problem_of(windows, noise)
    anchor = first_states(problem, _current(structure, p))
    known, first = state_precision(structure), anchor
    for _ in range(3):
        found = moments(problem, structure, p, first)
        step = reduce(np.nan_to_num(found.matrices), first, anchor, known).state_step
        good = np.isfinite(found.matrices[:, -1, -1])
        first = np.where(good[:, None], first + step, anchor)
    return first


def estimate(horizon: Horizon, solution: Solution) -> Estimate:
    """Parameters and their information from a solution of the horizon's windows (and perhaps one more)."""
    now = newest(horizon)
    dispersed = _dispersed(horizon.structure, horizon.windows, horizon.noise, solution.p, horizon.first)
    past = horizon.past.later(now, horizon.forget)
    information = np.einsum("w,wij->ij", ages(horizon, now), dispersed) + past.dispersed
    return Estimate(solution.p, information + np.diag(1.0 / horizon.prior.sd**2))


def _dispersed(
    structure: Structure, windows: tuple[Stretch, ...], noise: Noise, p: FloatArray, first: FloatArray
) -> FloatArray:
    """Information (w, np, np) with errors counted as they are at low frequency."""
    if not windows:
        return np.zeros((0, len(p), len(p)))
    now = moments(problem_of(windows, noise).dispersed, structure, p, first)
    return reduce(np.nan_to_num(now.matrices), first, first, state_precision(structure)).information


def slid(horizon: Horizon, most: int = MOST_WINDOWS) -> Horizon:
    """The horizon with no more than ``most`` windows: what the oldest say is kept, they are not."""
    while len(horizon.windows) > most:
        horizon = _leave(horizon)
    return horizon


def _leave(horizon: Horizon) -> Horizon:
    """Absorb the oldest window: the quadratic of its cost, with its first state eliminated, at the parameters."""
    structure, p, noise = horizon.structure, horizon.p, horizon.noise
    oldest, first = horizon.windows[:1], horizon.first[:1]
    found = moments(problem_of(oldest, noise), structure, p, first)
    reduced = reduce(found.matrices, first, first, state_precision(structure))
    past = horizon.past
    if np.isfinite(reduced.cost[0]):
        past = past.later(oldest[0].start + duration(oldest[0]), horizon.forget)
        mine = reduced.information[0]
        past = Knowledge(
            past.information + mine,
            past.vector + reduced.score[0] + mine @ p,
            past.dispersed + _dispersed(structure, oldest, noise, p, first)[0],
            past.at,
        )
    return replace(horizon, past=past, windows=horizon.windows[1:], first=horizon.first[1:])


def recalibrated(horizon: Horizon, solution: Solution) -> Horizon:
    """The horizon with every stream's noise as its errors show it."""
    if not horizon.windows:
        return horizon
    n = len(horizon.windows)
    kept = solution.moments.of(slice(n))
    problem = problem_of(horizon.windows, horizon.noise)
    found = calibrated(problem, replace(solution, moments=kept))
    noise = Noise(horizon.noise.sigma * _ratios(problem, found), found.inflation, found.dispersion)
    return replace(horizon, noise=noise, windows=found.stretches)


def _ratios(before: Problem, after: Problem) -> FloatArray:
    """By how much the σ of each stream (4,) was changed, lone wild samples apart."""
    kinds = np.concatenate([s.samples.kind for s in before.stretches])
    old, new = (np.concatenate([s.samples.sigma for s in p.stretches]) for p in (before, after))
    return np.array(
        [float(np.median((new / old)[kinds == k])) if (kinds == k).any() else 1.0 for k in range(4)]
    )
