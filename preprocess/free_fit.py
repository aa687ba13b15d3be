"""The search for responses and offsets of clocks: from several starts, sway and yaw apart first, then together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from preprocess.free_response import (
    BOTH,
    COUPLED,
    OFFSETS,
    POSED,
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

#: Offsets that are held where neither is looked for.
BOTH_HELD = (0, 1)
#: Rates k at which the search begins, in units of one over the response time; starts that are followed.
RATES, BEST = (0.3, 1.0), 1
#: Steps of the search, dampings that are tried for one of them, and rounds with the velocities' weights renewed.
STEPS, DAMPINGS, ROUNDS = 25, 6, 2
#: The share of the sum of squares whose gain ends the search, and the longest step in an offset, s.
SMALL, LARGE = 1e-3, 0.2


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


def fit(
    parts: Sequence[Stretch], pose: Pose, time: float, longest: float
) -> tuple[Fitted, tuple[Fitted, Fitted], FloatArray] | None:
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
    found : Fitted
    without : (Fitted, Fitted)
        The least that is left with the offset of the inputs, or of the position, held at zero.
    current : (2,) m/s
        To the north and east, beside no offset at all.
    """
    problem, none = Problem(parts, pose, time), np.zeros(1)
    grid = np.linspace(-longest, longest, 9)
    yaw = _apart(problem, _nothing(problem), YAW, grid)
    ends = [_together(problem, _apart(problem, yaw, SWAY, g)) for g in (grid, none)]
    still = _apart(problem, _apart(problem, _nothing(problem), YAW, none, BOTH_HELD), SWAY, none, BOTH_HELD)
    still, alone = _together(problem, still, BOTH_HELD)
    ends.append(_together(problem, still))
    guess, found = min(ends, key=lambda e: e[1].deviance)
    without = []
    for k in range(OFFSETS):
        tried = [_together(problem, _at_zero(g, k), (k,)) for g in (guess, still)]
        ends += [_together(problem, min(tried, key=lambda e: e[1].deviance)[0])]
        without.append(min((alone, *(f for _, f in tried)), key=lambda f: f.deviance))
    guess, found = min(ends, key=lambda e: e[1].deviance)
    settled = np.isfinite(found.error).all() and (np.abs(found.offsets) < 1.2 * longest).all()
    return (found, (without[0], without[1]), still.current) if settled else None


def _at_zero(guess: Guess, which: int) -> Guess:
    """The guess with one of its offsets zero."""
    offsets = guess.offsets.copy()
    offsets[which] = 0.0
    return replace(guess, offsets=offsets)


def _apart(problem: Problem, guess: Guess, which: int, grid: FloatArray, held: Sequence[int] = ()) -> Guess:
    """Sway or yaw by itself, from the best of some rates and offsets."""
    starts = sorted(
        (_start(problem, guess, which, k / problem.time, grid) for k in RATES), key=lambda x: x[1]
    )
    return min((_descent(problem, g, which, held) for g, _ in starts[:BEST]), key=lambda e: e[1].square)[0]


def _together(problem: Problem, guess: Guess, held: Sequence[int] = ()) -> tuple[Guess, Fitted]:
    """Sway and yaw together, from where they stand, some offsets held."""
    for _ in range(ROUNDS):
        guess, found = _descent(problem, guess, BOTH, held)
    return guess, found


def _nothing(problem: Problem) -> Guess:
    """No rates, no gains, at rest."""
    posed = problem.pose(problem.parts[0], np.zeros(POSED))
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


def _descent(problem: Problem, guess: Guess, which: int, held: Sequence[int] = ()) -> tuple[Guess, Fitted]:
    """Damped Gauss-Newton search, some offsets held, the velocities in units of what they leave first."""
    first = errors_of(problem, guess, which, slopes=False)[0]
    units = np.array([max(float(np.sqrt(np.mean(e**2))), 1e-12) for e in first])
    here, damping = _weighed(problem, guess, which, units), 1e-3
    use = np.setdiff1d(_unknowns(guess, which), here.design.shape[1] - OFFSETS + np.array(held, int))
    for _ in range(STEPS):
        before = here.square
        guess, here, damping = _stepped(problem, guess, which, here, use, damping)
        if here.square > (1.0 - SMALL) * before:
            break
    return guess, here


def _stepped(
    problem: Problem, guess: Guess, which: int, here: Fitted, use: IntArray, damping: float
) -> tuple[Guess, Fitted, float]:
    """The guess after a step of the unknowns in use that makes it better, with the next damping; else as it was."""
    scale = np.maximum(np.linalg.norm(here.design[:, use], axis=0), 1e-12)
    design = here.design[:, use] / scale
    matrix, side = design.T @ design, design.T @ here.error
    for _ in range(DAMPINGS):
        step = np.zeros(here.design.shape[1])
        step[use] = np.linalg.solve(matrix + (damping + 1e-9) * np.eye(len(use)), side) / scale
        step[-OFFSETS:] = np.clip(step[-OFFSETS:], -LARGE, LARGE)
        tried = guess.moved(step)
        found = _weighed(problem, tried, which, here.units)
        if found.square < here.square:
            return tried, found, max(0.1 * damping, 1e-9)
        damping *= 10.0
    return guess, here, damping


def _weighed(problem: Problem, guess: Guess, which: int, units: FloatArray) -> Fitted:
    errors, designs = errors_of(problem, guess, which, slopes=True)
    error = np.concatenate([e / x for e, x in zip(errors, units, strict=True)])
    design = np.vstack([d / x for d, x in zip(designs, units, strict=True)])
    return Fitted(guess.offsets, error, design, units)


def least_squares(design: FloatArray, error: FloatArray) -> FloatArray:
    """Least squares on columns scaled to one length; what is collinear is shared."""
    scale = np.maximum(np.linalg.norm(design, axis=0), 1e-12)
    return np.asarray(np.linalg.lstsq(design / scale, error, rcond=1e-6)[0] / scale, float)
