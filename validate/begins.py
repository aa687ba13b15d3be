"""Where in its slack a linkage is when a log begins: nobody logs it, but the first seconds of the log tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identify.first_states import first_states, state_precision
from identify.fitted import Fitted
from identify.output_error import solve
from identify.reduction import reduce
from identify.structure import Structure
from identify.windows import Problem, moments

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


def slack_begun(problem: Problem, structure: Structure, p: FloatArray) -> Structure:
    """The structure with every slack linkage begun, in a problem's logs, where it leaves the least error."""
    for k in _slack(structure):
        places = _likeliest(problem, structure, k, p, first_states(problem))
        structure = with_begin(structure, k, {**structure.actives[k].begin, **places})
    return structure


def _slack(structure: Structure) -> list[int]:
    """Places of the effects that have a begin of their own."""
    return [k for k, a in enumerate(structure.actives) if a.is_slack]


def _begun(fitted: Fitted, index: int, tolerance: float) -> Fitted:
    solution, problem = fitted.solution, fitted.problem
    places = _likeliest(problem, solution.structure, index, solution.p, solution.first)
    structure = with_begin(solution.structure, index, places)
    found = solve(
        problem, structure, solution.p, solution.first, fitted.prior, anchor=first_states(problem),
        budget=BUDGET, tolerance=tolerance,
    )  # fmt: skip
    return replace(fitted, solution=found) if found.total < solution.total else fitted


def _likeliest(
    problem: Problem, structure: Structure, index: int, p: FloatArray, first: FloatArray
) -> dict[str, float]:
    """For each log of a problem the begin of one effect that leaves the least error, between the places too."""
    logs = logs_of(problem)
    everywhere = [dict.fromkeys(logs, float(place)) for place in PLACES]
    costs = costs_begun(problem, structure, index, p, first, everywhere)
    return {log: _lowest(costs[log]) for log in logs}


def logs_of(problem: Problem) -> list[str]:
    """Names of a problem's logs."""
    return list(dict.fromkeys(s.name for s in problem.stretches))


def costs_begun(
    problem: Problem,
    structure: Structure,
    index: int,
    p: FloatArray,
    first: FloatArray,
    begins: Sequence[Mapping[str, float]],
) -> dict[str, FloatArray]:
    """For each log of a problem what it costs (len(begins),) where one effect began at each of some places."""
    logs = logs_of(problem)
    of_window = [logs.index(problem.stretches[w.stretch].name) for w in problem.windows]
    costs = []
    for begin in begins:
        there = with_begin(structure, index, begin)
        now = moments(problem, there, p, first)
        left = reduce(now.matrices, first, first_states(problem), state_precision(there)).cost
        costs.append(np.bincount(of_window, weights=np.nan_to_num(left, nan=np.inf), minlength=len(logs)))
    return dict(zip(logs, np.array(costs).T, strict=True))


def _lowest(costs: FloatArray) -> float:
    """Where a parabola through the least of the costs (places,) and its two neighbours is lowest."""
    best = int(np.argmin(costs))
    if not 0 < best < len(PLACES) - 1:
        return float(PLACES[best])
    return float(PLACES[best] + (PLACES[1] - PLACES[0]) * least_of_three(costs[best - 1 : best + 2]))


def least_of_three(costs: FloatArray) -> float:
    """Where a parabola through costs at -1, 0 and 1 is lowest; the lower end where it is bent the other way."""
    before, here, after = costs
    if not np.isfinite(costs).all():
        return 0.0
    bend = before - 2.0 * here + after
    return float(0.5 * (before - after) / bend) if bend > 0.0 else float(np.sign(before - after))


def with_begin(structure: Structure, index: int, begin: Mapping[str, float]) -> Structure:
    """The structure with one effect's begin in every log."""
    actives = list(structure.actives)
    actives[index] = replace(actives[index], begin=begin)
    return replace(structure, actives=tuple(actives))
