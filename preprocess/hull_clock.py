"""Offsets of position and inputs against the heading's clock, beside a whole hull: to what the samples allow.

A model of the sway's and the yaw's responses (``preprocess.response_clock``) finds them roughly; here a hull with all
usual terms, surge included, is run freely from there and held against the samples themselves (``preprocess.hull_fit``),
which knows as much of the offsets as the Cramér-Rao bound says, and is not led astray by what a smoother does.

Beside a current that the manoeuvre hardly tells from sway, what is left has long bent valleys and more than one lowest
place, and its curvature in any of them says little of how sure an offset is. So wherever an offset seems to differ from
zero, the hull is also fitted with that offset held at zero: where this leaves as little, the offset is not known.
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
    ROUGH_GAIN,
    Guess,
    Left,
    Problem,
    Window,
    cut_windows,
    normal,
    place_of,
    settle,
)
from preprocess.hull_run import BEYOND, STATE, free_terms
from preprocess.hull_start import RIDGE, begun_at, first_guess
from preprocess.trial import FloatArray, Measurement

#: Windows of the search in response times, short ones first, and the last in seconds where that is longer.
WINDOWS, LAST = (3.0, 8.0), (16.0, 50.0)
#: Rounds with the weights renewed in a search that another one follows, and in the last.
ROUNDS = (1, 3)
#: Blocks of samples whose errors go together, and inputs at most.
BLOCKS, MOST_INPUTS = 16, 6
#: A hull that leaves so many times the noise of any sensor says nothing of clocks; one that leaves less than so many,
#: nothing but noise.
FAR, CLEAN = 3.0, 1.2
#: An offset of so many standard errors seems to differ from zero.
SEEMS = 3.0
#: Numbers of the offsets of inputs and position.
BOTH = (0, 1)
#: What the model leaves out, as a share of the response time.
MODEL_SHARE = 0.002


@dataclass(frozen=True)
class Told:
    """Offsets and standard errors of the inputs and of the position, s; ``clean`` where nothing but noise is left."""

    late: tuple[float, float]
    off: tuple[float, float]
    clean: bool


@dataclass(frozen=True)
class Sailed:
    """A hull that was fitted: the problem, the guess that leaves least of it, and what it leaves."""

    problem: Problem
    guess: Guess
    left: Left

    @property
    def spreads(self) -> list[float]:
        """What is left of every stream, in units of its noise."""
        return [w * self.left.spread(k) for k, w in enumerate(self.problem.weights.tolist())]

    @property
    def near(self) -> bool:
        """Whether what is left of every stream is of the size of its noise."""
        return max(self.spreads) < FAR

    @property
    def deviance(self) -> float:
        """-2 log likelihood with the streams' noise free: compares fits of the same samples."""
        which = np.concatenate(self.left.stream)
        return float(sum(2.0 * np.sum(which == k) * np.log(x) for k, x in enumerate(self.spreads)))

    @property
    def offsets(self) -> tuple[float, float]:
        """Of the inputs and of the position, s."""
        return self.guess.late, self.guess.off


@dataclass(frozen=True)
class Search:
    """What a hull is held against: smoothed states, segments, inputs, sensors, step and windows' lengths, s."""

    states: pd.DataFrame
    segments: Segments
    inputs: Sequence[Acting]
    sensors: Sequence[Seen]
    step: float
    lengths: Sequence[float]

    def windows(self, length: float, off: float) -> tuple[Window, ...]:
        """Windows of about a length, the positions in them by stamps moved back."""
        return cut_windows(windows_of(self.segments, length), self.step, self.sensors, off)

    def begun(
        self, start: tuple[float, float], current: FloatArray, ridge: float, held: Sequence[int] = ()
    ) -> Sailed | None:
        """Search through windows of growing length, as far as the hull can follow; None where it cannot be run.

        Offsets whose numbers are ``held`` stay where they start.
        """
        places = tuple(places_of(self.inputs)[k] for k in held)
        problem = Problem((), self.inputs, np.ones(len(self.sensors)), np.empty(0), held=places)
        guess, found = None, None
        for length in self.lengths:
            problem = replace(problem, windows=self.windows(length, start[1] if guess is None else guess.off))
            if guess is None:
                guess, problem = first_guess(problem, self.states, start, current, ridge)
            guess = begun_at(problem, guess, self.states)
            end = length == self.lengths[-1]
            settled = settle(problem, guess, ROUNDS[end], LEAST_GAIN if end else ROUGH_GAIN)
            if settled is None:
                return None
            found = Sailed(*settled)
            if not found.near:
                break
            problem, guess = found.problem, found.guess
        return found

    def again(self, sailed: Sailed, held: Sequence[int]) -> Sailed | None:
        """Search on from where a hull stands, the offsets of these numbers held at zero."""
        late, off = (0.0 if k in held else x for k, x in enumerate(sailed.offsets))
        places = tuple(places_of(self.inputs)[k] for k in held)
        windows = self.windows(self.lengths[-1], off)
        problem = replace(sailed.problem, windows=windows, held=places)
        guess = begun_at(problem, replace(sailed.guess, late=late, off=off), self.states)
        settled = settle(problem, guess, ROUNDS[1], LEAST_GAIN)
        return None if settled is None else Sailed(*settled)


def told_by_hull(
    states: pd.DataFrame,
    segments: Segments,
    inputs: Sequence[Measurement],
    sensors: Sequence[Seen],
    time: float,
    step: float,
    start: tuple[float, float],
    current: FloatArray,
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
    current : (2,) m/s
        To the north and east, from which a search beside no offset begins.
    """
    if not 0 < len(inputs) <= MOST_INPUTS:
        return None
    last = max(LAST[0] * time, LAST[1])
    lengths = [x * time for x in WINDOWS if x * time < 0.7 * last] + [last]
    search = Search(states.dropna(), segments, [acting(m) for m in inputs], sensors, step, lengths)
    found = _first(search, start, np.zeros(2))
    if found is not None and found.near and not doubted(_errors(found), found):
        return _told(found, _errors(found), time)
    return _beside_none(search, found, current, time)


def places_of(inputs: Sequence[Acting]) -> tuple[int, int]:
    """Where the offsets of inputs and position stand among the unknowns."""
    p = len(free_terms(len(inputs))[0])
    return p, p + BEYOND + OFF


def _first(
    search: Search, start: tuple[float, float], current: FloatArray, held: Sequence[int] = ()
) -> Sailed | None:
    """The hull of the first ridge with which it can be run."""
    return next((x for r in RIDGE if (x := search.begun(start, current, r, held)) is not None), None)


def doubted(errors: Sequence[float], found: Sailed) -> Sequence[int]:
    """Numbers of the offsets that seem to differ from zero."""
    return [k for k, (x, e) in enumerate(zip(found.offsets, errors, strict=True)) if abs(x) > SEEMS * e]


def _beside_none(search: Search, found: Sailed | None, current: FloatArray, time: float) -> Told | None:
    """The offsets, as sure as hulls without one of them, or without any, leave them."""
    without = _without(search, found, current)
    followed = [x for x in (found, *(search.again(x, ()) for x in without)) if x is not None and x.near]
    if not followed:
        return None
    best = min(followed, key=lambda x: x.deviance)
    errors = _errors(best)
    for k in doubted(errors, best):
        others = (x for x in (*without, search.again(best, (k,))) if x is not None and x.offsets[k] == 0.0)
        errors[k] = max([errors[k], *(doubt(best, k, x) for x in others)])
    return _told(best, errors, time)


def _without(search: Search, found: Sailed | None, current: FloatArray) -> list[Sailed]:
    """Hulls that follow with those offsets at zero that seem to differ from it: each, and both."""
    late, off = (0.0, 0.0) if found is None else found.offsets
    seems = BOTH if found is None or not found.near else doubted(_errors(found), found)
    which: list[tuple[int, ...]] = [(k,) for k in seems]
    which += [BOTH] * (len(seems) == len(BOTH))
    begun = [_first(search, (late * (0 not in held), off * (1 not in held)), current, held) for held in which]
    return [x for x in begun if x is not None and x.near]


def doubt(found: Sailed, which: int, without: Sailed) -> float:
    """Standard error that an offset has at least where a hull without it leaves as little, s."""
    gain = max(without.deviance - found.deviance, 1e-12)
    return abs(found.offsets[which]) / float(np.sqrt(gain))


def _told(found: Sailed, errors: Sequence[float], time: float) -> Told | None:
    late, off = (
        (x, float(np.hypot(e, MODEL_SHARE * time))) for x, e in zip(found.offsets, errors, strict=True)
    )
    return Told(late, off, max(found.spreads) < CLEAN) if np.isfinite([*late, *off]).all() else None


def _errors(found: Sailed) -> list[float]:
    """Standard errors of the offsets: as samples' noise has it, and as errors that go together in blocks."""
    matrix, _, _ = normal(replace(found.problem, held=()), found.guess, found.left)
    scale = np.sqrt(np.diag(matrix)) + 1e-12
    inverse = np.linalg.inv(matrix / np.outer(scale, scale) + 1e-9 * np.eye(len(scale)))
    rows = [(column, inverse[column] / scale / scale[column]) for column in places_of(found.problem.inputs)]
    return [max(float(np.sqrt(row[column])), _by_blocks(row, found.left)) for column, row in rows]


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
