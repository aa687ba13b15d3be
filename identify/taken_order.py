"""Samples in the windows in which they were taken, where their stamps are known to be late.

A window that begins in a turn says nothing of a rate that was taken half a second before, whatever its stamp says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identify.base_fit import fit_states
from identify.drive import drive
from identify.first_states import first_states
from identify.fitted import Fitted
from identify.output_error import Prior, Solution, solve
from identify.stretch import Stretch
from identify.structure import Structure
from identify.windows import Problem, cut

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Stamps that are off by less than this share of a step are in the right windows as they are.
SHARE = 0.5


def in_order_taken(fitted: Fitted) -> Fitted:
    """The fit with its samples in the windows in which they were taken, as its clocks say, first states anew.

    Samples from before a stretch's begin, or after its end, are left out: nothing predicts them. A model that runs away
    from the smoothed motion keeps the first states that it has; from these too, all stays as it was.
    """
    structure, p = fitted.solution.structure, fitted.solution.p
    ordered = ordered_by(structure, p, fitted.problem)
    if ordered is fitted.problem:
        return fitted
    for states in (fit_states, partial(_kept, fitted.solution.first)):
        solution = states(ordered, structure, p)
        if np.isfinite(solution.cost):
            return replace(fitted, problem=ordered, solution=solution)
    return fitted


def _kept(first: FloatArray, problem: Problem, structure: Structure, p: FloatArray) -> Solution:
    """The solution at first states (w, 8) as they are, the parameters held."""
    return solve(problem, structure, p, first, Prior.held(p), anchor=first_states(problem), budget=0)


def ordered_by(structure: Structure, p: FloatArray, problem: Problem) -> Problem:
    """A problem with its samples in the windows in which they were taken, as the clocks of ``p`` (np,) say."""
    clocks = [drive(structure, p, s).sensor[5:9] for s in problem.stretches]
    pairs = list(zip(problem.stretches, clocks, strict=True))
    if all(np.max(np.abs(late - s.samples.late)) < SHARE * s.h for s, late in pairs):
        return problem
    return cut([by_clocks(s, late) for s, late in pairs], problem.length).weighted_as(problem)


def by_clocks(stretch: Stretch, late: FloatArray) -> Stretch:
    """A stretch with its samples in the order in which they were taken, by stamps that are ``late`` (4,)."""
    end = stretch.start + stretch.h * stretch.steps
    return replace(stretch, samples=stretch.samples.taken_within(stretch.start, end, late))


def as_in(stretches: Sequence[Stretch], stretch: Stretch) -> Stretch:
    """A stretch with its samples in the order of others', whose stamps are late by as much."""
    late = stretches[0].samples.late
    return by_clocks(stretch, late) if np.any(late != stretch.samples.late) else stretch
