"""Where a refit of a candidate may begin, other than where the fit without it is."""

from __future__ import annotations

from contextlib import suppress
from functools import partial

import numpy as np

from identify.base_fit import led, short_windows, tried
from identify.fitted import Fitted
from identify.regression import start_by_regression
from identify.rough_fit import roughly
from identify.settled import settled
from identify.structure import Structure
from ingest.errors import NotIdentifiable
from validate.candidates import Screened
from validate.scan import WORTH, gain_and_value

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def other_start(structure: Structure, screened: Screened, base: Fitted) -> tuple[FloatArray, FloatArray]:
    """Parameters and first states to begin with anew: where the accelerations clearly want a value, fitted with it.

    What ``leads`` and runs away over the base's windows then is led to it through shorter ones.
    """
    problem = base.problem
    gain, value = screened.wanted or gain_and_value(structure, problem.stretches, screened.unmoved)
    if gain <= WORTH:
        p = start_by_regression(structure, screened.p, problem.stretches, apart=True)
        return p, settled(problem, structure, p).first
    p = screened.p
    with suppress(NotIdentifiable):
        p = roughly(structure, problem.stretches, value, short_windows(problem, structure))
    there = settled(problem, structure, p)
    if not np.isfinite(there.cost) and screened.leads:
        longer = tried(partial(led, structure, problem.stretches, value, problem.length))
        p = p if longer is None else longer.solution.p
        there = settled(problem, structure, p)
    return p, there.first
