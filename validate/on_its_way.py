"""Where a slow actuator is as a log begins: on its way, maybe, from something that no log says any more.

It is taken to stand where it was first told to, but in logs that are decidedly likelier if it did not: what they begin
with would be made up for by all coefficients, and by how slow it is. What comes later in the logs tells these without.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from identify.base_fit import DECISIVE
from identify.first_states import first_states
from identify.fitted import Fitted
from identify.noise import recalibrated
from identify.output_error import solve
from identify.settled import settled
from identify.structure import Structure
from identify.windows import Problem, Window
from validate.begins import costs_begun, least_of_three, logs_of, with_begin
from validate.refits import under

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Begins that are looked at, in units of how far the input moves; from the best of them so many steps, the longest of
#: this share.
PLACES, STEPS, NEAR = np.linspace(-1.0, 1.0, 13), 4, 0.05
#: Steps of a refit.
FOLLOWED = 15


def on_its_way(fitted: Fitted) -> Fitted:
    """The fit with every slow actuator begun where it was in the logs that clearly ask for it, if that is likelier."""
    later = _later(fitted.problem)
    slow = [k for k, a in enumerate(fitted.solution.structure.actives) if a.effect.on_its_way]
    if not slow or len(later) < len(fitted.problem.windows) / 2:
        return fitted
    solution, problem = fitted.solution, fitted.problem
    without = replace(problem, windows=later)
    first = solution.first[[problem.windows.index(w) for w in later]]
    told = solve(
        without,
        solution.structure,
        solution.p,
        first,
        fitted.prior,
        anchor=first_states(without),
        budget=FOLLOWED,
    )
    structure = begun_where_it_was(problem, solution.structure, told.p)
    if structure == solution.structure:
        return fitted
    first = settled(problem, structure, told.p).first
    found = solve(
        problem, structure, told.p, first, fitted.prior, anchor=first_states(problem), budget=FOLLOWED
    )
    if not found.total < solution.total - DECISIVE:
        return fitted
    return under(recalibrated(problem, found), replace(fitted, solution=found), FOLLOWED)


def begun_where_it_was(problem: Problem, structure: Structure, p: FloatArray) -> Structure:
    """The structure with slow actuators begun, in a problem's logs that clearly ask for it, where they were.

    In others they begin as in the structure.
    """
    for k in [k for k, a in enumerate(structure.actives) if a.effect.on_its_way]:
        others = {log: x for log, x in structure.actives[k].begin.items() if log not in logs_of(problem)}
        structure = with_begin(structure, k, others | _off(problem, structure, k, p))
    return structure


def _later(problem: Problem) -> tuple[Window, ...]:
    """A problem's windows but for the first of every log."""
    begins = {problem.stretches[w.stretch].name: w for w in reversed(problem.windows)}
    return tuple(w for w in problem.windows if w not in begins.values())


def _off(problem: Problem, structure: Structure, index: int, p: FloatArray) -> dict[str, float]:
    """How far off what it was told an actuator began, its input's unit, in the logs that are decidedly likelier so."""
    sizes = _ranges(problem, structure.actives[index].variant.inputs[0])
    cost = partial(_costs, problem, structure, index, p)
    begins = [{log: by * size for log, size in sizes.items()} for by in PLACES]
    costs = [cost(begin) for begin in begins]
    at = {log: begins[int(np.argmin([c[log] for c in costs]))][log] for log in sizes}
    for _ in range(STEPS):
        around = [cost({log: x + by * NEAR * sizes[log] for log, x in at.items()}) for by in (-1.0, 0.0, 1.0)]
        moves = {log: least_of_three(np.array([c[log] for c in around])) for log in at}
        at = {log: x + NEAR * sizes[log] * min(max(moves[log], -1.0), 1.0) for log, x in at.items()}
    there, still = cost(at), cost(dict.fromkeys(sizes, 0.0))
    return {log: x for log, x in at.items() if there[log] < still[log] - DECISIVE}


def _costs(
    problem: Problem, structure: Structure, index: int, p: FloatArray, begin: Mapping[str, float]
) -> dict[str, float]:
    """What each log costs where an actuator began at a place of its own, first states at their best."""
    there = with_begin(structure, index, begin)
    costs = costs_begun(problem, structure, index, p, settled(problem, there, p).first, [begin])
    return {log: float(c[0]) for log, c in costs.items()}


def _ranges(problem: Problem, name: str) -> dict[str, float]:
    """How far an input moves in each log."""
    inputs = {s.name: s.inputs[name] for s in reversed(problem.stretches)}
    return {log: float(np.ptp(inputs[log].value[inputs[log].good])) for log in logs_of(problem)}
