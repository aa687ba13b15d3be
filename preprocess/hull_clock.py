"""Offsets of position and inputs against the heading's clock, beside a whole hull: to what the samples allow.

A model of the sway's and the yaw's responses (``preprocess.response_clock``) finds them roughly; here a hull with all
usual terms, surge included, is run freely from there and held against the samples themselves (``preprocess.hull_fit``),
which knows as much of the offsets as the Cramér-Rao bound says, and is not led astray by what a smoother does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from preprocess.chains import Segments
from preprocess.hull_data import Acting, Seen, acting, blocks_of, windows_of
from preprocess.hull_fit import (
    LEAST_GAIN,
    OFF,
    RIDGE,
    ROUGH_GAIN,
    Guess,
    Left,
    Problem,
    cut_windows,
    first_guess,
    firsts_of,
    normal,
    place_of,
    settle,
)
from preprocess.hull_run import BEYOND, STATE, free_terms
from preprocess.trial import FloatArray, Measurement

#: Windows of the search in response times, short ones first, and the last in seconds where that is longer.
WINDOWS, LAST = (3.0, 8.0), (16.0, 50.0)
#: Rounds with the weights renewed in a search that another one follows, and in the last.
ROUNDS = (1, 3)
#: Blocks of samples whose errors go together, and inputs at most.
BLOCKS, MOST_INPUTS = 16, 6
#: A hull that leaves so many times the noise of any sensor says nothing of clocks.
FAR = 3.0
#: What the model leaves out, as a share of the response time.
MODEL_SHARE = 0.002


@dataclass(frozen=True)
class Told:
    """Offsets and standard errors of the inputs and of the position, s."""

    late: tuple[float, float]
    off: tuple[float, float]


def told_by_hull(
    states: pd.DataFrame,
    segments: Segments,
    inputs: Sequence[Measurement],
    sensors: Sequence[Seen],
    time: float,
    step: float,
    start: tuple[float, float],
) -> Told | None:
    """Offsets of inputs and position beside a hull; None where it cannot follow the motion.

    Parameters
    ----------
    states : DataFrame
        Smoothed.
    segments : tuple of (start, end)
        What is looked at.
    inputs : sequence of Measurement
        Those that change.
    sensors : sequence of Seen
    time, step : float
        Response time of the vessel and step of the run, s.
    start : (late, off)
        Offsets from which the search begins, s.
    """
    if not 0 < len(inputs) <= MOST_INPUTS:
        return None
    known, acts = states.dropna(), [acting(m) for m in inputs]
    last = max(LAST[0] * time, LAST[1])
    lengths = [x * time for x in WINDOWS if x * time < 0.7 * last] + [last]
    for ridge in RIDGE:
        found = _searched(known, segments, acts, sensors, step, lengths, start, ridge)
        if found is not None:
            return _with_errors(*found, time) if near(found[0], found[2]) else None
    return None


def near(problem: Problem, left: Left) -> bool:
    """Whether what is left of every stream is of the size of its noise."""
    return bool(max(w * left.spread(k) for k, w in enumerate(problem.weights.tolist())) < FAR)


def _searched(
    states: pd.DataFrame,
    segments: Segments,
    inputs: Sequence[Acting],
    sensors: Sequence[Seen],
    step: float,
    lengths: Sequence[float],
    start: tuple[float, float],
    ridge: float,
) -> tuple[Problem, Guess, Left] | None:
    """Search through windows of growing length, as far as the hull can follow; None where it cannot be run at all."""
    (late, off), guess, found = start, None, None
    problem = Problem((), inputs, np.ones(len(sensors)), np.empty(0))
    for length in lengths:
        windows = cut_windows(windows_of(segments, length), step, sensors, off)
        problem = replace(problem, windows=windows)
        if guess is None:
            guess, prior = first_guess(problem, states, late, off, ridge)
            problem = replace(problem, prior=prior)
        guess = replace(guess, firsts=firsts_of(problem, states, off))
        end = length == lengths[-1]
        found = settle(problem, guess, ROUNDS[end], LEAST_GAIN if end else ROUGH_GAIN)
        if found is None:
            return None
        problem, guess, left = found
        if not near(problem, left):
            break
        off = guess.off
    return found


def _with_errors(problem: Problem, guess: Guess, left: Left, time: float) -> Told | None:
    """The offsets with their standard errors: as samples' noise has it, and as errors that go together in blocks."""
    matrix, _, _ = normal(problem, guess, left)
    scale = np.sqrt(np.diag(matrix)) + 1e-12
    inverse = np.linalg.inv(matrix / np.outer(scale, scale) + 1e-9 * np.eye(len(scale)))
    p = len(free_terms(len(problem.inputs))[0])
    out = []
    for column in (p, p + BEYOND + OFF):
        row = inverse[column] / scale * (1.0 / scale[column])
        stderr = max(float(np.sqrt(row[column])), _by_blocks(row, left))
        out.append(float(np.hypot(stderr, MODEL_SHARE * time)))
    told = Told((guess.late, out[0]), (guess.off, out[1]))
    return told if np.isfinite([*told.late, *told.off]).all() else None


def _by_blocks(row: FloatArray, left: Left) -> float:
    """Standard error of the unknown with this row of the covariance, errors of a block counted together."""
    shared = left.slopes[0].shape[1] - STATE
    share = [
        d @ row[place_of(shared, k)] * e
        for k, (e, d) in enumerate(zip(left.errors, left.slopes, strict=True))
    ]
    whole = np.concatenate(share)
    sums = np.array([whole[b].sum() for b in blocks_of(np.concatenate(left.t), BLOCKS)])
    return float(np.sqrt(sums @ sums * BLOCKS / (BLOCKS - 1.0)))
