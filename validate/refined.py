"""A fit taken to windows of another length."""

from __future__ import annotations

import numpy as np

from identify.base_fit import fit_from_scratch
from identify.drive import drive
from identify.first_states import first_states
from identify.fitted import Fitted
from identify.noise import calibrated_anew
from identify.output_error import solve
from identify.settled import settled
from identify.structure import effects_alone
from identify.windows import cut
from validate.refits import step_tolerance


def refined(fitted: Fitted, length: float) -> Fitted:
    """The same structure on windows of another length, weights from its own errors."""
    structure, p = fitted.solution.structure, fitted.solution.p
    problem = cut(fitted.problem.stretches, length)
    problem = problem.weighted_as(fitted.problem)
    current = drive(structure, p, problem.stretches[0]).current
    begin = settled(problem, structure, p)
    first = begin.first if np.isfinite(begin.cost) else first_states(problem, current)
    solution = solve(problem, structure, p, first, fitted.prior, budget=30)
    if not np.isfinite(solution.cost):
        return fit_from_scratch(structure, fitted.problem.stretches, effects_alone(structure, p))
    for _ in range(2):
        problem = calibrated_anew(problem, solution)  # longer windows show what short ones hide
        tolerance = step_tolerance(Fitted(problem, fitted.prior, solution))
        solution = solve(
            problem, structure, solution.p, solution.first, fitted.prior, anchor=first_states(problem, current),
            budget=20, tolerance=tolerance,
        )  # fmt: skip
    return Fitted(problem, fitted.prior, solution)
