"""Output error over windows: damped Gauss-Newton on all parameters, each window's first state eliminated.

The cost is the squared error of the raw measurements in units of their noise, plus what is known beforehand. Every
window's first state is eliminated exactly from the normal equations (a Schur complement), so that their number costs
nothing; what is left is the information on the parameters, from which covariance, score tests and cross-validation
follow without another run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from identify.first_states import state_precision
from identify.kernel import NX
from identify.moments import Moments
from identify.reduction import Reduced, damped_step, reduce
from identify.structure import Structure
from identify.windows import Problem, moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: A coefficient is known beforehand to be within this many times its natural size.
RIDGE = 30.0
#: A search begins with so much damping.
DAMPED = 1e-2
#: Standard deviation of a parameter that is not to move.
HELD = 1e-9
#: A step that goes too far is taken in part, so often at most, each time half or less, or this where it ran away.
SHORTENED, HALF, RAN_AWAY = 2, 0.5, 0.1
#: More damping is tried instead where less of it is good than this.
LEAST_PART = 0.03


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
        return cls(p, np.full(len(p), HELD))

    def holding(self, p: FloatArray, which: BoolArray) -> Prior:
        """The same, but some of the parameters (np,) are not to move from ``p`` (np,)."""
        return replace(self, mean=np.where(which, p, self.mean), sd=np.where(which, HELD, self.sd))


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


def prior_for(structure: Structure, scales: FloatArray, ridge: float = RIDGE) -> Prior:
    """Ridge on coefficients from their natural sizes (terms,), priors of the slots, nothing on the others."""
    mean, sd = np.zeros(len(structure.slots)), np.full(len(structure.slots), np.inf)
    for k, slot in enumerate(structure.slots):
        if slot.prior is not None:
            mean[k], sd[k] = slot.prior
        elif slot.coefficient >= 0:
            sd[k] = ridge * max(scales[slot.coefficient], 1e-12)
    return Prior(mean, sd, ridge)


@dataclass(frozen=True)
class _Place:
    """Where a search is: ``p`` (np,), ``first`` (w, 8), their moments, and what is known beforehand as a cost."""

    p: FloatArray
    first: FloatArray
    moments: Moments
    penalty: float

    @property
    def total(self) -> float:
        """Cost with the priors'."""
        return self.moments.cost + self.penalty


@dataclass(frozen=True)
class _Way:
    """Where to go from a place: to parameters ``p`` (np,) and by ``first`` (w, 8), and what is ``held`` at a bound.

    ``promised`` is the gain that it promises, ``slope`` that of the cost at its begin.
    """

    p: FloatArray
    first: FloatArray
    promised: float
    slope: float
    held: BoolArray


@dataclass(frozen=True)
class _Task:
    """What is to be minimised: ``anchor`` (w, 8), ``known`` (8,) of first states; ``low``, ``high`` (np,) bounds."""

    problem: Problem
    structure: Structure
    prior: Prior
    anchor: FloatArray
    known: FloatArray
    low: FloatArray
    high: FloatArray

    def at(self, p: FloatArray, first: FloatArray) -> _Place:
        """The place with these parameters and first states; derivatives that overflow have run away as a path does."""
        penalty = np.sum(((p - self.prior.mean) / self.prior.sd) ** 2)
        penalty += np.sum((first - self.anchor) ** 2 * self.known)
        found = moments(self.problem, self.structure, p, first)
        known = np.isfinite(found.matrices).all()
        return _Place(p, first, found, float(penalty) if known else np.inf)

    def way(self, here: _Place, damping: float) -> _Way:
        """Damped step of parameters and first states; parameters stay within their bounds."""
        matrices, prior = here.moments.matrices, self.prior
        reduced = reduce(matrices, here.first, self.anchor, self.known, damping)
        information = reduced.information.sum(axis=0) + np.diag(1.0 / prior.sd**2)
        pull = (here.p - prior.mean) / prior.sd**2
        score = reduced.score.sum(axis=0) - pull
        held = ((here.p <= self.low) & (score < 0)) | ((here.p >= self.high) & (score > 0))
        move = damped_step(information, score, ~held, damping)
        first = reduced.state_step - np.einsum("wij,j->wi", reduced.state_slope, move)
        gx = matrices[:, :NX, -1] - (here.first - self.anchor) * self.known
        promised = float(score @ move + np.sum(gx * reduced.state_step))
        end = np.clip(here.p + move, self.low, self.high)
        down = (matrices[:, NX:-1, -1].sum(axis=0) - pull) @ (end - here.p) + np.sum(gx * first)
        return _Way(end, first, promised, -2.0 * float(down), held)

    def along(self, here: _Place, way: _Way, part: float) -> _Place:
        """Part of the way from a place; its end to the last digit, for that may be a bound."""
        p = way.p if part == 1.0 else here.p + part * (way.p - here.p)
        return self.at(p, here.first + part * way.first)

    def ended(self, here: _Place, held: BoolArray, stopped: Stopped, steps: int) -> Solution:
        """The solution where a search ended."""
        known = np.nan_to_num(here.moments.matrices, posinf=0.0, neginf=0.0)
        reduced = reduce(known, here.first, self.anchor, self.known)
        return Solution(
            self.structure, here.p, here.first, here.moments.cost, here.penalty, reduced, here.moments, held, stopped,
            steps,
        )  # fmt: skip


@dataclass(frozen=True)
class _Stride:
    """How a search steps: its damping, the part of a step that is tried, and how often that was shortened."""

    damping: float = DAMPED
    part: float = 1.0
    shortened: int = 0

    @property
    def longer(self) -> _Stride:
        """That of a new step: twice the part that was good last."""
        return replace(self, part=min(1.0, 2.0 * self.part))

    def after(self, gain: float, promised: float) -> _Stride:
        """After a good step."""
        ease = 0.1 if self.part == 1.0 and gain > 0.5 * promised else 1.0
        return replace(self, damping=max(ease * self.damping, 1e-7), shortened=0)

    def shorter(self, slope: float, gain: float) -> _Stride:
        """After a step that went too far: to the lowest place of the parabola through its slope and its end."""
        part, slope = self.part, self.part * slope
        if not np.isfinite(gain):
            part *= RAN_AWAY
        else:
            part *= min(HALF, slope / (2.0 * (slope + gain))) if slope < 0.0 else 0.0
        if self.shortened == SHORTENED or part < LEAST_PART:
            return _Stride(10.0 * max(self.damping, 1e-4))
        return replace(self, part=part, shortened=self.shortened + 1)


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

    A step that goes too far is taken in part: where a model lacks something the cost's valleys are bent, and damping
    alone would turn every step away from the valley's own direction. The next one begins with twice that part. Where
    hardly any of a step is good, its direction is not, and there is more damping.
    """
    anchor = first if anchor is None else anchor
    low, high = (np.array([s.parameter.bounds[k] for s in structure.slots]) for k in (0, 1))
    task = _Task(problem, structure, prior, anchor, state_precision(structure), low, high)
    here = task.at(np.clip(p, low, high), first)
    stride, step = _Stride(), 0
    held: BoolArray = np.zeros(len(p), dtype=bool)
    if not np.isfinite(here.total):
        return task.ended(here, held, Stopped.DIVERGED, 0)
    for step in range(1, budget + 1):
        if not stride.shortened:
            way, stride = task.way(here, stride.damping), stride.longer
            held = way.held
            if way.promised < tolerance:
                return task.ended(here, held, Stopped.CONVERGED, step)
            if step > 4 and here.total - 10.0 * way.promised > target:
                return task.ended(here, held, Stopped.HOPELESS, step)
        there = task.along(here, way, stride.part)
        gain = here.total - there.total
        if gain > 0.0:
            here, stride = there, stride.after(gain, way.promised)
            if gain < 0.2 * tolerance:
                return task.ended(here, held, Stopped.CONVERGED, step)
        else:
            stride = stride.shorter(way.slope, gain)
            if stride.damping > 1e7:
                return task.ended(here, held, Stopped.STALLED, step)
    return task.ended(here, held, Stopped.BUDGET, step)


def information_of(solution: Solution, prior: Prior) -> FloatArray:
    """Information matrix (np, np) of the parameters, priors included."""
    known = np.diag(1.0 / prior.sd**2)
    return np.asarray(solution.reduced.information.sum(axis=0) + known, dtype=float)
