"""Output error over windows: damped Gauss-Newton on all parameters, each window's first state eliminated.

The cost is the squared error of the raw measurements in units of their noise, plus what is known beforehand. Every
window's first state is eliminated exactly from the normal equations (a Schur complement), so that their number costs
nothing; what is left is the information on the parameters, from which covariance, score tests and cross-validation
follow without another run.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from identify.first_states import state_precision
from identify.kernel import NX
from identify.structure import Structure
from identify.windows import Moments, Problem, moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: A coefficient is known beforehand to be within this many times its natural size.
RIDGE = 30.0


class Stopped(Enum):
    """Why the search stopped."""

    CONVERGED = "The search stopped because no step promised to lower the cost any more."
    STALLED = "The search stopped because no step lowered the cost, however small."
    HOPELESS = "The search was given up because it could not reach what another had reached."
    BUDGET = "The search stopped because it had used up its steps."
    DIVERGED = "The prediction ran away from the first step on."


@dataclass(frozen=True)
class Prior:
    """What is known of the parameters beforehand: means and standard deviations (np,), infinite where nothing is.

    ``ridge`` is how many times its natural size a coefficient may have.
    """

    mean: FloatArray
    sd: FloatArray
    ridge: float = RIDGE

    @classmethod
    def held(cls, p: FloatArray) -> Prior:
        """Parameters that are not to move from ``p`` (np,)."""
        return cls(p, np.full(len(p), 1e-9))


@dataclass(frozen=True)
class Reduced:
    """Normal equations with the first states eliminated.

    ``information`` (w, np, np) and ``score`` (w, np) per window; ``cost`` (w,) is the cost left per window at its best
    first state; ``state_step`` (w, 8) and ``state_slope`` (w, 8, np) give that state: step - slope @ δp.
    """

    information: FloatArray
    score: FloatArray
    cost: FloatArray
    state_step: FloatArray
    state_slope: FloatArray


@dataclass(frozen=True)
class Solution:
    """Where a search ended.

    ``p`` (np,), ``first`` (w, 8), ``cost`` without and ``penalty`` with priors, ``reduced`` the normal equations
    there, ``moments`` the raw moments, ``held`` the parameters at a bound.
    """

    structure: Structure
    p: FloatArray
    first: FloatArray
    cost: float
    penalty: float
    reduced: Reduced
    moments: Moments
    held: BoolArray
    stopped: Stopped
    steps: int

    @property
    def stayed(self) -> bool:
        """Whether it ended where it began: no first step promised anything."""
        return self.stopped is Stopped.CONVERGED and self.steps <= 1

    @property
    def total(self) -> float:
        """Cost with what is known beforehand: -2 log posterior up to a constant."""
        return self.cost + self.penalty


def reduce(
    matrices: FloatArray,
    first: FloatArray,
    anchor: FloatArray,
    known: FloatArray,
    damping: float | FloatArray = 0.0,
) -> Reduced:
    """Eliminate every window's first state from its moment matrix (w, 8 + np + 1 square).

    ``known`` (8,) is the precision with which the ``anchor`` is known beforehand; ``damping`` is one number, or (w, 1).
    """
    a = matrices[:, :NX, :NX].copy()
    index = np.arange(NX)
    a[:, index, index] += known
    a[:, index, index] *= 1.0 + damping
    b = matrices[:, :NX, NX:-1]
    gx = matrices[:, :NX, -1] - (first - anchor) * known
    scale = 1.0 / np.sqrt(np.maximum(a[:, index, index], 1e-300))
    a *= scale[:, :, None] * scale[:, None, :]
    a[:, index, index] += 1e-13
    right = np.concatenate([gx[:, :, None], b], axis=2) * scale[:, :, None]
    solved = np.linalg.solve(a, right) * scale[:, :, None]
    step, slope = solved[:, :, 0], solved[:, :, 1:]
    information = matrices[:, NX:-1, NX:-1] - np.swapaxes(b, 1, 2) @ slope
    score = matrices[:, NX:-1, -1] - np.einsum("wij,wi->wj", b, step)
    cost = matrices[:, -1, -1] - np.einsum("wi,wi->w", gx, step)
    return Reduced(information, score, cost, step, slope)


def prior_for(structure: Structure, scales: FloatArray, ridge: float = RIDGE) -> Prior:
    """Ridge on coefficients from their natural sizes (terms,), priors of the slots, nothing on the others."""
    mean, sd = np.zeros(len(structure.slots)), np.full(len(structure.slots), np.inf)
    for k, slot in enumerate(structure.slots):
        if slot.prior is not None:
            mean[k], sd[k] = slot.prior
        elif slot.coefficient >= 0:
            sd[k] = ridge * max(scales[slot.coefficient], 1e-12)
    return Prior(mean, sd, ridge)


def _penalty(p: FloatArray, first: FloatArray, anchor: FloatArray, prior: Prior, known: FloatArray) -> float:
    states = np.sum((first - anchor) ** 2 * known)
    return float(np.sum(((p - prior.mean) / prior.sd) ** 2) + states)


def solve(
    problem: Problem,
    structure: Structure,
    p: FloatArray,
    first: FloatArray,
    prior: Prior,
    *,
    anchor: FloatArray | None = None,
    tolerance: float = 0.05,
    budget: int = 40,
    target: float = np.inf,
) -> Solution:
    """Minimise the windowed output error from ``p`` (np,) and ``first`` (w, 8).

    ``tolerance`` is in units of the cost: the search stops where the next step promises less. The same rule serves
    every structure, so that costs can be compared. Where even ten times the gain that is promised would not bring the
    cost below ``target``, the search is given up.
    """
    anchor = first if anchor is None else anchor
    known = state_precision(structure)
    low, high = (np.array([s.parameter.bounds[k] for s in structure.slots]) for k in (0, 1))
    p = np.clip(p, low, high)
    now = moments(problem, structure, p, first)
    penalty = _penalty(p, first, anchor, prior, known)
    damping, stopped, step = 1e-3, Stopped.BUDGET, 0
    held: BoolArray = np.zeros(len(p), dtype=bool)
    if not np.isfinite(now.cost):
        return _end(structure, p, first, now, penalty, anchor, held, Stopped.DIVERGED, 0, known)
    for step in range(1, budget + 1):
        move, d_first, promised, held = _direction(now, p, first, anchor, prior, damping, low, high, known)
        if promised < tolerance:
            stopped = Stopped.CONVERGED
            break
        if step > 4 and now.cost + penalty - 10.0 * promised > target:
            stopped = Stopped.HOPELESS
            break
        trial_p, trial_first = np.clip(p + move, low, high), first + d_first
        trial = moments(problem, structure, trial_p, trial_first)
        trial_penalty = _penalty(trial_p, trial_first, anchor, prior, known)
        gain = now.cost + penalty - trial.cost - trial_penalty
        if np.isfinite(gain) and gain > 0:
            p, first, now, penalty = trial_p, trial_first, trial, trial_penalty
            damping = max(damping * (0.1 if gain > 0.5 * promised else 1.0), 1e-7)
            if gain < 0.2 * tolerance:
                stopped = Stopped.CONVERGED
                break
        else:
            damping = max(damping, 1e-4) * 10.0
            if damping > 1e7:
                stopped = Stopped.STALLED
                break
    return _end(structure, p, first, now, penalty, anchor, held, stopped, step, known)


def _end(
    structure: Structure, p: FloatArray, first: FloatArray, now: Moments, penalty: float, anchor: FloatArray,
    held: BoolArray, stopped: Stopped, steps: int, known: FloatArray,
) -> Solution:  # fmt: skip
    reduced = reduce(np.nan_to_num(now.matrices), first, anchor, known)
    return Solution(structure, p, first, now.cost, penalty, reduced, now, held, stopped, steps)


def _direction(
    now: Moments, p: FloatArray, first: FloatArray, anchor: FloatArray, prior: Prior, damping: float,
    low: FloatArray, high: FloatArray, known: FloatArray,
) -> tuple[FloatArray, FloatArray, float, BoolArray]:  # fmt: skip
    """Damped step of parameters and first states, the gain that it promises, and the parameters held at a bound."""
    reduced = reduce(now.matrices, first, anchor, known, damping)
    information = reduced.information.sum(axis=0) + np.diag(1.0 / prior.sd**2)
    score = reduced.score.sum(axis=0) - (p - prior.mean) / prior.sd**2
    held = ((p <= low) & (score < 0)) | ((p >= high) & (score > 0))
    move = _damped(information, score, ~held, damping)
    d_first = reduced.state_step - np.einsum("wij,j->wi", reduced.state_slope, move)
    gx = now.matrices[:, :NX, -1] - (first - anchor) * known
    promised = float(score @ move + np.sum(gx * reduced.state_step))
    return move, d_first, promised, held


def _damped(information: FloatArray, score: FloatArray, free: BoolArray, damping: float) -> FloatArray:
    """Levenberg-Marquardt step on columns scaled to unit diagonal; held parameters stay."""
    move = np.zeros(len(score))
    if not free.any():
        return move
    part = information[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(part), 1e-30))
    scaled = part * scale * scale[:, None] + (damping + 1e-10) * np.eye(len(part))
    move[free] = scale * np.linalg.solve(scaled, scale * score[free])
    return move


def information_of(solution: Solution, prior: Prior) -> FloatArray:
    """Information matrix (np, np) of the parameters, priors included."""
    known = np.diag(1.0 / prior.sd**2)
    return np.asarray(solution.reduced.information.sum(axis=0) + known, dtype=float)
