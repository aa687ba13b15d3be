"""How well a model predicts what its fit has not seen: parts of the logs, each left out in turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.base_fit import window_length
from identify.drive import drive
from identify.fitted import Fitted
from identify.output_error import solve
from identify.predict import run, shown, true_first_state
from identify.prepare import Prepared
from identify.stretch import Stretch
from identify.structure import Structure
from identify.windows import Problem

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: At most so many parts are left out in turn.
MOST_PARTS = 5
#: An error counts as at most so many spreads: a prediction that ran away is bad, not infinitely so.
CAP = 3.0


def squares_left_out(prepared: Prepared, fitted: Fitted) -> list[tuple[float, int]]:
    """Squared error, in units of each channel's spread, and number of samples of each part, by a fit to the others."""
    return [_left_out(prepared, fitted, part) for part in parts_of(fitted.problem)]


def parts_of(problem: Problem) -> list[list[int]]:
    """Windows by log where there are two logs or more (short ones joined to five parts), else thirds of the one."""
    names = [problem.stretches[w.stretch].name for w in problem.windows]
    distinct = list(dict.fromkeys(names))
    if len(distinct) < 2:
        return [list(map(int, part)) for part in np.array_split(np.arange(len(names)), 3) if len(part)]
    group = {n: k % MOST_PARTS for k, n in enumerate(distinct)}
    return [[k for k, n in enumerate(names) if group[n] == g] for g in range(min(len(distinct), MOST_PARTS))]


def _left_out(prepared: Prepared, fitted: Fitted, part: list[int]) -> tuple[float, int]:
    """Squared error and number of samples of the windows in ``part``, by a fit to the others."""
    problem, solution = fitted.problem, fitted.solution
    rest = [k for k in range(len(problem.windows)) if k not in set(part)]
    fewer = replace(problem, windows=tuple(problem.windows[k] for k in rest))
    tolerance = 1e-3 * solution.cost
    again = solve(
        fewer,
        solution.structure,
        solution.p,
        solution.first[rest],
        fitted.prior,
        budget=6,
        tolerance=tolerance,
    )
    spread = np.vstack([s.states[:, 3:6] for s in prepared.identify]).std(axis=0) + 1e-9
    joined = spans(problem, part, prepared.structure.vessel.length)
    errors = [_errors(solution.structure, again.p, s, a, n) / spread for s, a, n in joined]
    stacked = np.vstack(errors)
    capped = np.clip(np.nan_to_num(stacked, nan=CAP), -CAP, CAP)
    return float(np.sum(capped**2) / 3.0), len(capped)


def spans(problem: Problem, part: list[int], length: float) -> list[tuple[Stretch, int, int]]:
    """Neighbouring windows joined to spans of about the length of a long window: stretch, first step, steps.

    ``length`` is the vessel's.
    """
    joined: list[list[int]] = []
    for k in part:
        w = problem.windows[k]
        stretch = problem.stretches[w.stretch]
        longest = window_length(length) / stretch.h
        last = joined[-1] if joined else None
        if (
            last
            and last[0] == w.stretch
            and last[1] + last[2] == w.first
            and last[2] + w.steps <= 1.2 * longest
        ):
            last[2] += w.steps
        else:
            joined.append([w.stretch, w.first, w.steps])
    return [(problem.stretches[s], first, steps) for s, first, steps in joined]


def _errors(structure: Structure, p: FloatArray, stretch: Stretch, first: int, steps: int) -> FloatArray:
    """Prediction less smoothed u, v, r (steps + 1, 3) over a span, from its first smoothed state."""
    d = drive(structure, p, stretch)
    start = true_first_state(structure, d, stretch, first)
    predicted = shown(structure, d, stretch, run(structure, d, stretch, start, first, steps))
    return np.asarray(predicted[:, 3:6] - stretch.states[first : first + steps + 1, 3:6], dtype=float)
