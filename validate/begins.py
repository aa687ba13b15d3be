"""Where in its slack a linkage is when a log begins: nobody logs it, but the first seconds of the log tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.first_states import first_states, state_precision
from identify.fitted import Fitted
from identify.output_error import solve
from identify.reduction import reduce
from identify.structure import Structure
from identify.windows import moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Places that are looked at, from one end of the slack to the other.
PLACES = (-1.0, -0.5, 0.0, 0.5, 1.0)
#: Steps of the refit from there.
BUDGET = 12


def from_where_it_was(fitted: Fitted, tolerance: float) -> Fitted:
    """The fit with every slack linkage begun, in each log, where it leaves the least error; the better of the two."""
    best = fitted
    for k, active in enumerate(fitted.solution.structure.actives):
        if active.effect.begins and active.effect.begins(active.variant.options):
            best = _begun(best, k, tolerance)
    return best


def _begun(fitted: Fitted, index: int, tolerance: float) -> Fitted:
    solution, problem = fitted.solution, fitted.problem
    logs = list(dict.fromkeys(s.name for s in problem.stretches))
    of_window = [logs.index(problem.stretches[w.stretch].name) for w in problem.windows]
    costs = []
    for place in PLACES:
        structure = _at(solution.structure, index, dict.fromkeys(logs, place))
        now = moments(problem, structure, solution.p, solution.first)
        left = reduce(now.matrices, solution.first, first_states(problem), state_precision(structure)).cost
        costs.append(np.bincount(of_window, weights=np.nan_to_num(left, nan=np.inf), minlength=len(logs)))
    best = np.argmin(costs, axis=0)
    structure = _at(solution.structure, index, {n: PLACES[b] for n, b in zip(logs, best, strict=True)})
    found = solve(
        problem, structure, solution.p, solution.first, fitted.prior, anchor=first_states(problem),
        budget=BUDGET, tolerance=tolerance,
    )  # fmt: skip
    return replace(fitted, solution=found) if found.total < solution.total else fitted


def _at(structure: Structure, index: int, begin: dict[str, float]) -> Structure:
    """The structure with one effect's begin in every log."""
    actives = list(structure.actives)
    actives[index] = replace(actives[index], begin=begin)
    return replace(structure, actives=tuple(actives))
