"""A fit over long windows from scratch, its coefficients held near zero first and let go in steps.

Where positions wander, the sway is hardly seen within half a minute: a regression of the smoothed motion has it damped
by anything, short windows do not tell better, and a search that begins there ends in one of many valleys. Long windows
do tell. So that none of them runs away from a poor start, the axes begin apart, and a firm prior lets no coefficient
cancel another until the rest are near (continuation in the ridge).
"""

from __future__ import annotations

import numpy as np

from identify.first_states import first_states
from identify.fitted import Fitted
from identify.noise import calibrated, calibrated_anew
from identify.output_error import RIDGE, prior_for, solve
from identify.regression import coefficient_scales, start_by_regression
from identify.settled import settled
from identify.stretch import Stretch
from identify.structure import Structure
from identify.windows import cut

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Ridges, in natural sizes of the coefficients, one after the other, each with weights found so many times.
RIDGES, TIMES = (0.3, 1.0, 3.0, RIDGE), 2
#: Ridge of the regression that a search begins with where an ordinary one may run away in long windows.
FIRM = 1e-2
#: Steps under each of the weights, and the gain that is worth one, as a share of the rows.
BUDGET, ENOUGH = 25, 1e-4


def loosened(
    structure: Structure, stretches: tuple[Stretch, ...], values: FloatArray, length: float
) -> Fitted:
    """Fit windows of a length at once, from effects' ``values`` (np,), under ever looser ridges."""
    p = start_by_regression(structure, values, stretches, FIRM, apart=True)
    problem = cut(stretches, length)
    for ridge in RIDGES:
        prior = prior_for(structure, coefficient_scales(structure, p, stretches), ridge)
        here = settled(problem, structure, p)
        problem, first = calibrated_anew(problem, here, fine=False), here.first
        for _ in range(TIMES):
            anchor, tolerance = first_states(problem), ENOUGH * problem.rows
            found = solve(
                problem, structure, p, first, prior, anchor=anchor, tolerance=tolerance, budget=BUDGET
            )
            problem, p, first = calibrated(problem, found), found.p, found.first
    return Fitted(problem, prior, found)
