"""The search for responses and offsets of clocks: from several starts, sway and yaw apart first, then together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from preprocess.free_response import (
    BOTH,
    COUPLED,
    OFFSETS,
    SWAY,
    YAW,
    Guess,
    Pose,
    Problem,
    Stretch,
    errors_of,
)
from preprocess.kalman import IntArray
from preprocess.trial import FloatArray

#: Rates k at which the search begins, in units of one over the response time; starts that are followed.
RATES, BEST = (0.3, 1.0), 1
#: Steps of the search, halvings of a step that makes it worse, and rounds with the velocities' weights renewed.
STEPS, HALVINGS, ROUNDS = 10, 4, 2
#: A step in the offsets that ends the search, and the longest, s.
SMALL, LARGE = 2e-4, 0.2


@dataclass(frozen=True)
class Fitted:
    """The responses that leave least.

    Attributes
    ----------
    offsets : (2,)
        Of inputs and position, s.
    error : (k,)
        What is left in the windows, of sway and then of yaw, in units of their spread.
    design : (k, p)
        Sensitivities of the windows to all unknowns, the offsets last.
    units : (2,)
        Those spreads.
    """

    offsets: FloatArray
    error: FloatArray
    design: FloatArray
    units: FloatArray

    @property
    def square(self) -> float:
        """Sum of the squared errors."""
        return float(self.error @ self.error)

    @property
    def deviance(self) -> float:
        """-2 log likelihood per window with both spreads free: compares fits in different units."""
        left = np.mean(np.array(np.split(self.error, 2)) ** 2, axis=1) * self.units**2
        return float(np.log(np.maximum(left, 1e-300)).sum())


def fit(parts: Sequence[Stretch], pose: Pose, time: float, longest: float) -> tuple[Fitted, Fitted] | None:
    """Fit responses and offsets; None where nothing settles.

    Parameters
    ----------
    parts : sequence of Stretch
        All of one grid interval.
    pose : Pose
    time : float
        Response time, roughly, s.
    longest : float
        Offsets are looked for up to this, s.

    Returns
    -------
    found, without : Fitted
        The second with both offsets held at zero.
    """
    problem = Problem(parts, pose, time)
    grid = np.linspace(-longest, longest, 9)
    guess = _apart(problem, _nothing(problem), YAW, grid)
    ends = [_together(problem, _apart(problem, guess, SWAY, g)) for g in (grid, np.zeros(1))]
    guess, found = min(ends, key=lambda e: e[1].deviance)
    _, without = _descent(problem, replace(guess, offsets=np.zeros(OFFSETS)), BOTH, held=True)
    settled = np.isfinite(found.error).all() and (np.abs(found.offsets) < 1.2 * longest).all()
    return (found, without) if settled else None


def _apart(problem: Problem, guess: Guess, which: int, grid: FloatArray) -> Guess:
    """Sway or yaw by itself, from the best of some rates and offsets."""
    starts = sorted(
        (_start(problem, guess, which, k / problem.time, grid) for k in RATES), key=lambda x: x[1]
    )
    return min((_descent(problem, g, which) for g, _ in starts[:BEST]), key=lambda e: e[1].square)[0]


def _together(problem: Problem, guess: Guess) -> tuple[Guess, Fitted]:
    """Sway and yaw together, from where they stand."""
    for _ in range(ROUNDS):
        guess, found = _descent(problem, guess, BOTH)
    return guess, found


def _nothing(problem: Problem) -> Guess:
    """No rates, no gains, at rest."""
    posed = problem.pose(problem.parts[0], 0.0, 0.0)
    sway, yaw = (
        (np.zeros(2 + d.weights.shape[1]), np.zeros(d.columns.shape[1])) for d in (posed.sway, posed.yaw)
    )
    return Guess(
        sway, yaw, np.zeros(COUPLED), np.zeros((2, len(problem.parts))), np.zeros(2), np.zeros(OFFSETS)
    )


def _start(problem: Problem, guess: Guess, which: int, rate: float, grid: FloatArray) -> tuple[Guess, float]:
    """The offset at which sway or yaw, at a constant rate, leaves least; and what it leaves."""
    rates, gains = (guess.sway, guess.yaw)[which]
    part = (np.r_[rate, np.zeros(len(rates) - 1)], gains)
    guess = replace(guess, sway=part) if which == SWAY else replace(guess, yaw=part)
    tried = []
    for tau in grid.tolist():
        offsets = guess.offsets.copy()
        offsets[1 - which] = tau
        here = replace(guess, offsets=offsets)
        (error,), (design,) = errors_of(problem, here, which, slopes=False)
        use = _unknowns(guess, which)[len(rates) : -1]
        step = np.zeros(design.shape[1])
        step[use] = least_squares(design[:, use], error)
        tried.append((here.moved(step), float(np.sum((error - design @ step) ** 2))))
    return min(tried, key=lambda x: x[1])


def _unknowns(guess: Guess, which: int) -> IntArray:
    """Which unknowns belong to sway, to yaw, or to both: rates first, the offset last."""
    place, count = guess.places, guess.first.shape[1]
    if which == BOTH:
        return np.arange(place[-1].stop)
    first = place[5].start + which * count
    parts = [place[2 * which], place[2 * which + 1], slice(first, first + count)]
    parts += [place[4] if which == YAW else place[6]]
    return np.concatenate([*(np.arange(p.start, p.stop) for p in parts), [place[7].start + 1 - which]])


def _descent(problem: Problem, guess: Guess, which: int, held: bool = False) -> tuple[Guess, Fitted]:
    """Gauss-Newton search, the velocities in units of what they leave first; a step that makes it worse is halved."""
    first = errors_of(problem, guess, which, slopes=False)[0]
    units = np.array([max(float(np.sqrt(np.mean(e**2))), 1e-12) for e in first])
    here, use = _weighed(problem, guess, which, units), _unknowns(guess, which)
    if held:
        use = use[use < here.design.shape[1] - OFFSETS]
    for _ in range(STEPS):
        step = np.zeros(here.design.shape[1])
        step[use] = least_squares(here.design[:, use], here.error)
        step[-OFFSETS:] = np.clip(step[-OFFSETS:], -LARGE, LARGE)
        better = _shortened(problem, guess, which, units, step, here.square)
        if better is None:
            break
        done = (
            np.abs(better[1].offsets - here.offsets).max() < SMALL and better[1].square > 0.999 * here.square
        )
        guess, here = better
        if done:
            break
    return guess, here


def _shortened(
    problem: Problem, guess: Guess, which: int, units: FloatArray, step: FloatArray, square: float
) -> tuple[Guess, Fitted] | None:
    """The guess after a step, halved until it is no worse; None where no part of it helps."""
    for halving in range(HALVINGS):
        tried = guess.moved(step * 0.5**halving)
        found = _weighed(problem, tried, which, units)
        if found.square <= square * (1.0 + 1e-9):
            return tried, found
    return None


def _weighed(problem: Problem, guess: Guess, which: int, units: FloatArray) -> Fitted:
    errors, designs = errors_of(problem, guess, which, slopes=True)
    error = np.concatenate([e / x for e, x in zip(errors, units, strict=True)])
    design = np.vstack([d / x for d, x in zip(designs, units, strict=True)])
    return Fitted(guess.offsets, error, design, units)


def least_squares(design: FloatArray, error: FloatArray) -> FloatArray:
    """Least squares on columns scaled to one length; what is collinear is shared."""
    scale = np.maximum(np.linalg.norm(design, axis=0), 1e-12)
    return np.asarray(np.linalg.lstsq(design / scale, error, rcond=1e-6)[0] / scale, float)
