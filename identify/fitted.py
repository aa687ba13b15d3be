"""A fit: where a search ended, with what it solved, and how far from the noise it is."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from identify import kernel
from identify.averaged import Mean
from identify.disturbed import Disturbed
from identify.left_out import Refit
from identify.output_error import Prior, Solution
from identify.predict import runs_away
from identify.remembered import Remembered
from identify.settled import Settled
from identify.windows import Problem

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Above this cost per degree of freedom a model is so far from the noise that its weights need no refinement.
FAR = 3.0
#: Below this cost per degree of freedom a model is at the noise.
NEAR = 1.2
#: ... if no stream's slow errors are so many times its noise, or more.
SLOW = 1.5
#: Slow errors of less than this, in units of their noise, leave nothing to look for elsewhere.
SLOWLY = 1.1


@dataclass(frozen=True)
class AtNoise:
    """How far off the noise a fit may be and count as at it: cost per degree of freedom, and slow errors.

    Many samples of white noise hide slow errors in the cost.
    """

    chi2_per_dof: float = NEAR
    slow: float = SLOW

    def holds(self, fitted: Fitted) -> bool:
        """Whether a fit is no farther off."""
        return fitted.chi2_per_dof < self.chi2_per_dof and not fitted.slow > self.slow


@dataclass(frozen=True)
class Fitted:
    """A solution with the problem and the prior that it solves.

    ``refits`` are fits to fewer of the logs, each left out in turn; ``mean`` says what it is the mean of, if of
    several; ``disturbed`` what shows of pushes that none logs;
    ``wider`` (np,) how many times wider intervals are than the noise alone says (``identify.scattered``).
    """

    problem: Problem
    prior: Prior
    solution: Solution
    refits: tuple[Refit, ...] = ()
    mean: Mean | None = None
    disturbed: Disturbed | None = None
    wider: FloatArray | None = None

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone: what is remembered can be made again elsewhere."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @cached_property
    def remembered(self) -> Remembered[Fitted]:
        """What was made of this fit."""
        return Remembered(self)

    @property
    def degrees_of_freedom(self) -> int:
        """Rows less first states and parameters."""
        n_states = int((self.solution.moments.matrices[:, range(8), range(8)] > 0).sum())
        return max(1, self.problem.rows - n_states - len(self.solution.p))

    @property
    def chi2_per_dof(self) -> float:
        """Squared errors over the white noise of the sensors, per degree of freedom; infinite where it ran away."""
        if not np.isfinite(self.solution.cost):
            return math.inf
        return chi2_of(self.problem, self.solution) / self.degrees_of_freedom

    @property
    def astray_by(self) -> float:
        """How far from the noise: log of the mean square of each axis of each stream over its white noise, summed.

        Whichever weights it was fitted with: where one stream is far off they hardly ask it, and say little of others.
        """
        if not np.isfinite(self.solution.cost):
            return math.inf
        return float(np.sum(np.log(np.maximum(1.0, _mean_squares(self.problem, self.solution)))))

    @property
    def slow(self) -> float:
        """How many times their noise the slow errors are of the stream that has most, positions apart.

        A receiver wanders by itself.
        """
        return float(np.delete(self.problem.dispersed.inflation, kernel.POSITION).max())

    @property
    def is_as_sensors_say(self) -> bool:
        """Whether it is at the noise, and that is no more than the sensors' own."""
        return not self.is_off and float(self.problem.inflation.max()) < NEAR

    @property
    def is_off(self) -> bool:
        """Whether it is off the noise, or has slow errors that many samples of white noise may hide."""
        return not AtNoise().holds(self)

    @property
    def runs_away(self) -> bool:
        """Whether free runs leave all bounds over a log that was identified on: nobody should be given such a fit."""
        return any(runs_away(self.solution.structure, self.solution.p, s) for s in self.problem.stretches)

    @property
    def is_far(self) -> bool:
        """Whether it is far from the noise, or runs away: then what predicts its own logs best is taken."""
        return not self.chi2_per_dof < FAR or self.runs_away


def _mean_squares(problem: Problem, found: Solution) -> FloatArray:
    """Mean square (k, 2) of the errors of each stream's axes in units of its white noise; nothing for one without."""
    kinds = np.concatenate([problem.kinds(w) for w in problem.windows])
    squares = np.concatenate(found.moments.residuals) ** 2 * problem.inflation[kinds][:, None] ** 2
    sums = np.stack([np.bincount(kinds, weights=x, minlength=4) for x in squares.T], axis=1)
    return np.asarray(sums / np.maximum(np.bincount(kinds, minlength=4), 1)[:, None])


def chi2_of(problem: Problem, found: Solution | Settled) -> float:
    """Squared errors over the white noise of the sensors."""
    total = 0.0
    for w, residual in zip(problem.windows, found.moments.residuals, strict=True):
        total += float(np.sum(residual**2 * (problem.inflation[problem.kinds(w)] ** 2)[:, None]))
    return total
