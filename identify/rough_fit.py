"""Where searches begin: windows that do not run away, and rough fits in some of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from identify.noise import calibrated
from identify.output_error import Solution, prior_for, solve
from identify.regression import coefficient_scales, start_by_regression
from identify.settled import Settled, settled
from identify.stretch import Stretch
from identify.structure import Structure
from identify.windows import Problem, cut
from ingest.errors import NotIdentifiable

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A rough search takes so many steps under each weights.
BRIEF = (8, 12)
#: ... in one of so many windows, each parameter still seen by so many rows, and each log by so many windows: an effect
#: may be in one log alone.
THIN, SEEN_BY, OF_EACH_LOG = 6, 130, 2
#: Far from the noise no step is worth taking that promises less than this share of the cost.
SLIGHT = 1e-3
#: What is said where no fit can begin.
RAN_AWAY = (
    "the model runs away from the measurements at once, whatever its coefficients. See with `seatrial inspect` whether "
    "the inputs are those of the vessel, calibrated and of the right sign, or declare a model with fewer terms."
)


def begin_windows(
    structure: Structure, stretches: tuple[Stretch, ...], p: FloatArray, length: float
) -> tuple[Problem, Settled]:
    """Windows in which the start does not run away: shorter ones, or without any coefficients.

    Raises
    ------
    NotIdentifiable : if it runs away even so, or no window is long enough for more than a few samples
    """
    bare = np.where([s.coefficient < 0 for s in structure.slots], p, 0.0)
    for q, part in ((p, 1.0), (p, 0.4), (bare, 1.0)):
        problem = cut(stretches, part * length)
        found = settled(problem, structure, q) if problem.windows else None
        if found and np.isfinite(found.cost):
            return problem, found
    raise NotIdentifiable(RAN_AWAY)


def roughly(structure: Structure, stretches: tuple[Stretch, ...], p: FloatArray, length: float) -> FloatArray:
    """Parameters (np,) near the best in short windows, some of them, from a regression with the effects of ``p``."""
    return roughly_from(structure, stretches, start_by_regression(structure, p, stretches), length)


def roughly_from(
    structure: Structure, stretches: tuple[Stretch, ...], p: FloatArray, length: float
) -> FloatArray:
    """The same, from ``p`` (np,) as it is."""
    problem, begun = begin_windows(structure, stretches, p, length)
    some = replace(problem, windows=problem.windows[thin(problem, len(p))])
    here: Settled | Solution = settled(some, structure, begun.p)
    prior = prior_for(structure, coefficient_scales(structure, p, stretches))
    for budget in BRIEF:
        some = calibrated(some, here)
        here = solve(some, structure, here.p, here.first, prior, budget=budget, tolerance=SLIGHT * some.rows)
    return here.p


def thin(problem: Problem, count: int) -> slice:
    """Some of a problem's windows, enough of them for so many parameters, and of every log."""
    windows = Counter(problem.stretches[w.stretch].name for w in problem.windows)
    most = min(THIN, problem.rows // (SEEN_BY * count), min(windows.values()) // OF_EACH_LOG)
    return slice(None, None, max(1, most))
