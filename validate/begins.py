"""Where in its slack a linkage is when a log begins: nobody logs it, but the first seconds of the log tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.base_fit import window_length
from identify.first_states import first_states, state_precision
from identify.fitted import Fitted
from identify.output_error import solve
from identify.reduction import reduce
from identify.stretch import Stretch
from identify.structure import Structure
from identify.windows import Problem, cut, moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Places that are looked at, from one end of the slack to the other.
PLACES = np.linspace(-1.0, 1.0, 9)
#: Steps of the refit from there.
BUDGET = 12


def from_where_it_was(fitted: Fitted, tolerance: float) -> Fitted:
    """The fit with every slack linkage begun, in each log, where it leaves the least error; the better of the two."""
    best = fitted
    for k in _slack(fitted.solution.structure):
        best = _begun(best, k, tolerance)
    return best


def begun_in(fitted: Fitted, others: Sequence[Stretch]) -> Fitted:
    """The same fit, every slack linkage begun in logs that it has not seen where their first seconds say.

    As first states do, it comes of what a prediction begins with: of a window's length, and of nothing after it.
    """
    structure = fitted.solution.structure
    slack, seen = _slack(structure), {s.name for s in fitted.problem.stretches}
    unseen = [s for s in others if s.name not in seen]
    if not slack or not unseen:
        return fitted
    problem = _first_windows(cut(unseen, window_length(structure.vessel.length)).weighted_as(fitted.problem))
    for k in slack:
        places = _likeliest(problem, structure, k, fitted.solution.p, first_states(problem))
        structure = _at(structure, k, {**structure.actives[k].begin, **places})
    return replace(fitted, solution=replace(fitted.solution, structure=structure))


def _slack(structure: Structure) -> list[int]:
    """Places of the effects that have a begin of their own."""
    return [k for k, a in enumerate(structure.actives) if a.is_slack]


def _first_windows(problem: Problem) -> Problem:
    """Of each log the first window alone."""
    first = {problem.stretches[w.stretch].name: w for w in reversed(problem.windows)}
    return replace(problem, windows=tuple(w for w in problem.windows if w in first.values()))


def _begun(fitted: Fitted, index: int, tolerance: float) -> Fitted:
    solution, problem = fitted.solution, fitted.problem
    places = _likeliest(problem, solution.structure, index, solution.p, solution.first)
    structure = _at(solution.structure, index, places)
    found = solve(
        problem, structure, solution.p, solution.first, fitted.prior, anchor=first_states(problem),
        budget=BUDGET, tolerance=tolerance,
    )  # fmt: skip
    return replace(fitted, solution=found) if found.total < solution.total else fitted


def _likeliest(
    problem: Problem, structure: Structure, index: int, p: FloatArray, first: FloatArray
) -> dict[str, float]:
    """For each log of a problem the begin of one effect that leaves the least error, between the places too."""
    logs = list(dict.fromkeys(s.name for s in problem.stretches))
    of_window = [logs.index(problem.stretches[w.stretch].name) for w in problem.windows]
    costs = []
    for place in PLACES:
        there = _at(structure, index, dict.fromkeys(logs, float(place)))
        now = moments(problem, there, p, first)
        left = reduce(now.matrices, first, first_states(problem), state_precision(there)).cost
        costs.append(np.bincount(of_window, weights=np.nan_to_num(left, nan=np.inf), minlength=len(logs)))
    return dict(zip(logs, map(_lowest, np.array(costs).T), strict=True))


def _lowest(costs: FloatArray) -> float:
    """Where a parabola through the least of the costs (places,) and its two neighbours is lowest."""
    best = int(np.argmin(costs))
    if not 0 < best < len(PLACES) - 1 or not np.isfinite(costs[best - 1 : best + 2]).all():
        return float(PLACES[best])
    before, least, after = costs[best - 1 : best + 2]
    bend = before - 2.0 * least + after
    aside = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(PLACES[best] + aside * (PLACES[1] - PLACES[0]))


def _at(structure: Structure, index: int, begin: dict[str, float]) -> Structure:
    """The structure with one effect's begin in every log."""
    actives = list(structure.actives)
    actives[index] = replace(actives[index], begin=begin)
    return replace(structure, actives=tuple(actives))
