"""Steps down the cost: damped Gauss-Newton, shortened where they go too far, and along a valley that is bent.

Where parameters stand in for one another the cost's valley is narrow and bent: any straight step that is worth its
time leaves it. A path along it has an acceleration: what the errors' second derivative along the step asks for, by the
same damped normal equations (Transtrum, Machta and Sethna 2011, Phys. Rev. E 83, 036701). With half of that added a
step stays in the valley where without it a hundredth of it would have been too far. That holds near the noise; far from
it errors bend in every direction, and less of a step, or more damping, does as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from identify.kernel import NX
from identify.moments import Moments
from identify.reduction import Reduced, damped_step, reduce
from identify.structure import Structure
from identify.windows import Problem, moments

if TYPE_CHECKING:
    from identify.output_error import Prior

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: A search begins with so much damping; no less than the second is of use.
DAMPED, LEAST_DAMPED = 1e-2, 1e-9
#: So much hides nothing of what a step would gain.
LITTLE = 1e-7
#: A good step leaves this share of the damping, or once one was too bold the second: the right one is then near.
EASED, CAUTIOUS = 0.1, 0.5
#: Damping after a step of which hardly any is good: so many times as much, from no less than the second.
DAMPENED, FROM = 10.0, 1e-4
#: ... near the noise, and there so many times that for each such step one after the other.
DAMPENED_NEAR, FROM_NEAR, EACH_MORE = 3.0, 1e-6, 4.0
#: A step that goes too far is taken in part, so often at most, each time half or less, or this where it ran away.
SHORTENED, HALF, RAN_AWAY = 2, 0.5, 0.1
#: More damping is tried instead where less of it is good than this.
LEAST_PART = 0.03
#: Errors' second derivative is taken over this part of a step; an acceleration of more than its length is no small one.
NEARBY, TOO_BENT = 0.1, 1.5
#: Bent steps are tried no more where so many, one after the other, were no good.
IN_VAIN = 2


@dataclass(frozen=True)
class Place:
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
class Way:
    """Where to go from a place: to parameters ``p`` (np,) and by ``first`` (w, 8), and what is ``held`` at a bound.

    ``promised`` is the gain that it promises, ``slope`` that of the cost at its begin, ``damping`` what it was found
    with.
    """

    p: FloatArray
    first: FloatArray
    promised: float
    slope: float
    held: BoolArray
    damping: float


@dataclass(frozen=True)
class Task:
    """What is to be minimised: ``anchor`` (w, 8), ``known`` (8,) of first states; ``low``, ``high`` (np,) bounds."""

    problem: Problem
    structure: Structure
    prior: Prior
    anchor: FloatArray
    known: FloatArray
    low: FloatArray
    high: FloatArray

    def at(self, p: FloatArray, first: FloatArray) -> Place:
        """The place with these parameters and first states; derivatives that overflow have run away as a path does."""
        penalty = np.sum(((p - self.prior.mean) / self.prior.sd) ** 2)
        penalty += np.sum((first - self.anchor) ** 2 * self.known)
        found = moments(self.problem, self.structure, p, first)
        known = np.isfinite(found.matrices).all()
        return Place(p, first, found, float(penalty) if known else np.inf)

    def way(self, here: Place, damping: float) -> Way:
        """Damped step of parameters and first states; parameters stay within their bounds."""
        matrices, prior = here.moments.matrices, self.prior
        reduced = reduce(matrices, here.first, self.anchor, self.known, damping)
        pull = (here.p - prior.mean) / prior.sd**2
        score = reduced.score.sum(axis=0) - pull
        held = self.held(here.p, score)
        move, first = self._solved(reduced, score, ~held, damping)
        gx = matrices[:, :NX, -1] - (here.first - self.anchor) * self.known
        promised = float(score @ move + np.sum(gx * reduced.state_step))
        end = np.clip(here.p + move, self.low, self.high)
        down = (matrices[:, NX:-1, -1].sum(axis=0) - pull) @ (end - here.p) + np.sum(gx * first)
        return Way(end, first, promised, -2.0 * float(down), held, damping)

    def held(self, p: FloatArray, score: FloatArray) -> BoolArray:
        """Which parameters (np,) are at a bound that the score pushes them against."""
        return np.asarray(((p <= self.low) & (score < 0)) | ((p >= self.high) & (score > 0)), dtype=bool)

    def along(self, here: Place, way: Way, part: float) -> Place:
        """Part of the way from a place; its end to the last digit, for that may be a bound."""
        p = way.p if part == 1.0 else here.p + part * (way.p - here.p)
        return self.at(p, here.first + part * way.first)

    def bent(self, here: Place, way: Way) -> Place | None:
        """The end of a way that bends as the valley does; None where it bends by more than its length, or runs away."""
        second = self._second_derivative(here, way)
        if second is None:
            return None
        matrices = here.moments.matrices.copy()
        with_it = moments(self.problem, self.structure, here.p, here.first, added=second).matrices
        matrices[:, :-1, -1] = with_it[:, :-1, -1] - matrices[:, :-1, -1]
        reduced = reduce(matrices, self.anchor, self.anchor, self.known, way.damping)
        move, first = self._solved(reduced, reduced.score.sum(axis=0), ~way.held, way.damping)
        size = np.sqrt(np.diag(reduced.information.sum(axis=0)) + 1.0 / self.prior.sd**2)
        if not 2.0 * np.linalg.norm(size * move) < TOO_BENT * np.linalg.norm(size * (way.p - here.p)):
            return None
        p = np.clip(way.p + 0.5 * move, self.low, self.high)
        return self.at(p, here.first + way.first + 0.5 * first)

    def _second_derivative(self, here: Place, way: Way) -> list[FloatArray] | None:
        """That (m, 2) of every window's errors along a way, by a central difference; None where one runs away."""
        ahead, behind = (
            moments(
                self.problem, self.structure, here.p + part * (way.p - here.p), here.first + part * way.first,
                held=True,
            )
            for part in (NEARBY, -NEARBY)
        )  # fmt: skip
        if not np.isfinite(ahead.cost + behind.cost):
            return None
        between = zip(ahead.raw, here.moments.raw, behind.raw, strict=True)
        return [(a - 2.0 * e + b) / NEARBY**2 for a, e, b in between]

    def _solved(
        self, reduced: Reduced, score: FloatArray, free: BoolArray, damping: float
    ) -> tuple[FloatArray, FloatArray]:
        """The damped step (np,) of the free parameters, and that (w, 8) of the first states with it."""
        information = reduced.information.sum(axis=0) + np.diag(1.0 / self.prior.sd**2)
        move = damped_step(information, score, free, damping)
        return move, reduced.state_step - np.einsum("wij,j->wi", reduced.state_slope, move)


@dataclass(frozen=True)
class Stride:
    """How a search steps: its damping, the part of a step that is tried, and how often that was shortened.

    ``bold`` counts the steps one after the other of which hardly any was good, ``warned`` says whether any ever was;
    ``in_vain`` counts the bent ones, one after the other, that were no good.
    """

    damping: float = DAMPED
    part: float = 1.0
    shortened: int = 0
    bold: int = 0
    warned: bool = False
    in_vain: int = 0

    @property
    def longer(self) -> Stride:
        """That of a new step: twice the part that was good last."""
        return replace(self, part=min(1.0, 2.0 * self.part))

    def after(self, gain: float, promised: float) -> Stride:
        """After a good step."""
        ease = (CAUTIOUS if self.warned else EASED) if self.part == 1.0 and gain > 0.5 * promised else 1.0
        return replace(self, damping=max(ease * self.damping, LEAST_DAMPED), shortened=0, bold=0)

    @property
    def bolder(self) -> Stride | None:
        """With less damping, where a step promises nothing with what careful easing left; None where that is little."""
        return replace(self, damping=EASED * self.damping) if self.warned and self.damping > LITTLE else None

    def good_part(self, slope: float, gain: float) -> float:
        """The part of what was tried that is good: to the lowest place of the parabola through its slope and end."""
        if not np.isfinite(gain):
            return RAN_AWAY
        slope *= self.part
        return min(HALF, slope / (2.0 * (slope + gain))) if slope < 0.0 else 0.0

    def shorter(self, slope: float, gain: float, near: bool) -> Stride:
        """After a step that went too far, ``near`` the noise or not: less of it, or more damping."""
        part = self.part * self.good_part(slope, gain)
        if self.shortened < SHORTENED and part >= LEAST_PART:
            return replace(self, part=part, shortened=self.shortened + 1)
        if not near:
            return Stride(DAMPENED * max(self.damping, FROM), in_vain=self.in_vain)
        damping = DAMPENED_NEAR * EACH_MORE**self.bold * max(self.damping, FROM_NEAR)
        return Stride(damping, bold=self.bold + 1, warned=True, in_vain=self.in_vain)

    def having_bent(self, good: bool) -> Stride:
        """After a bent step."""
        return replace(self, in_vain=0 if good else self.in_vain + 1)

    def leaves_the_valley(self, gain: float) -> bool:
        """Whether a whole step is no good: it may not be too long, but straight where the valley is bent."""
        return bool(self.part == 1.0 and self.in_vain < IN_VAIN and np.isfinite(gain) and gain <= 0.0)
