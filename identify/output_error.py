"""Output error over windows: damped Gauss-Newton on all parameters, each window's first state eliminated.

The cost is the squared error of the raw measurements in units of their noise, plus what is known beforehand. Every
window's first state is eliminated exactly from the normal equations (a Schur complement), so that their number costs
nothing; what is left is the information on the parameters, from which covariance, score tests and cross-validation
follow without another run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from identify.descent import Place, Stride, Task
from identify.first_states import state_precision
from identify.moments import Moments
from identify.reduction import Reduced, reduce
from identify.structure import Structure
from identify.windows import Problem

if TYPE_CHECKING:
    from identify.optimisers import StopReason

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: A coefficient is known beforehand to be within this many times its natural size.
RIDGE = 30.0
#: Standard deviation of a parameter that is not to move.
HELD = 1e-9
#: Below so much per measured row, in units of white noise, a search is near it, and steps are bent as the valley is.
NEAR = 3.0


class Stopped(Enum):
    """Why the search stopped."""

    CONVERGED = "The search stopped because no step promised to lower the cost any more."
    STALLED = "The search stopped because no step lowered the cost, however small."
    HOPELESS = "The search was given up because it could not reach what another had reached."
    BUDGET = "The search stopped because it had used up its steps."
    DIVERGED = "The prediction ran away from the first step on."
    SOLVED = "Nothing was searched: a regression solves for its coefficients at once."


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
    there, ``moments`` the raw moments, ``held`` the parameters at a bound; ``stopped`` an optimiser's own reason where
    that searched.
    """

    structure: Structure
    p: FloatArray
    first: FloatArray
    cost: float
    penalty: float
    reduced: Reduced
    moments: Moments
    held: BoolArray
    stopped: Stopped | StopReason
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
    hardly any of a step is good, its direction is not, and there is more damping. Near the noise a step that goes too
    far is first bent as the valley is (``identify.descent``).
    """
    anchor = first if anchor is None else anchor
    low, high = (np.array([s.parameter.bounds[k] for s in structure.slots]) for k in (0, 1))
    task = Task(problem, structure, prior, anchor, state_precision(structure), low, high)
    here = task.at(np.clip(p, low, high), first)
    stride, step = Stride(), 0
    if not np.isfinite(here.total):
        return _ended(task, here, Stopped.DIVERGED, 0)
    for step in range(1, budget + 1):
        if not stride.shortened:
            way, stride = task.way(here, stride.damping), stride.longer
            if way.promised < tolerance and stride.bolder:
                stride = stride.bolder
                continue
            if way.promised < tolerance:
                return _ended(task, here, Stopped.CONVERGED, step)
            if step > 4 and here.total - 10.0 * way.promised > target:
                return _ended(task, here, Stopped.HOPELESS, step)
        there = task.along(here, way, stride.part)
        gain = here.total - there.total
        near = here.total * problem.inflated < NEAR * problem.rows
        if near and stride.leaves_the_valley(gain):
            bent = task.bent(here, way)
            stride = stride.having_bent(bent is not None and bent.total < here.total)
            if bent and bent.total < here.total:
                there, gain = bent, here.total - bent.total
        if gain > 0.0:
            here, stride = there, stride.after(gain, way.promised)
            if gain < 0.2 * tolerance:
                return _ended(task, here, Stopped.CONVERGED, step)
        else:
            stride = stride.shorter(way.slope, gain, near)
            if stride.damping > 1e7:
                return _ended(task, here, Stopped.STALLED, step)
    return _ended(task, here, Stopped.BUDGET, step)


def _ended(task: Task, here: Place, stopped: Stopped, steps: int) -> Solution:
    """The solution where a search ended."""
    known = np.nan_to_num(here.moments.matrices, posinf=0.0, neginf=0.0)
    reduced = reduce(known, here.first, task.anchor, task.known)
    held = task.held(here.p, reduced.score.sum(axis=0) - (here.p - task.prior.mean) / task.prior.sd**2)
    return Solution(
        task.structure, here.p, here.first, here.moments.cost, here.penalty, reduced, here.moments, held, stopped,
        steps,
    )  # fmt: skip


def information_of(solution: Solution, prior: Prior) -> FloatArray:
    """Information matrix (np, np) of the parameters, priors included."""
    known = np.diag(1.0 / prior.sd**2)
    return np.asarray(solution.reduced.information.sum(axis=0) + known, dtype=float)
