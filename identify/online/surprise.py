"""How surprising a short block of measurements is, given the model as it was known before the block.

A block is predicted over its whole length from a first state that is left free; the parameters are known with the
uncertainty that they have. Its errors, whitened, give two statistics: their size (χ² with as many degrees of freedom as
there are rows, first state taken off), which sees anything, and what constant accelerations of u, v, r in the block
would explain of them (χ² with 3 degrees of freedom), which sees slow, structural error long before the former does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.drive import drive
from identify.effect import Active, Effect, Setting, Variant
from identify.first_states import state_precision
from identify.kernel import NX
from identify.online.horizon import Horizon, problem_of, update
from identify.online.knowledge import Estimate, Knowledge, Noise
from identify.output_error import Prior
from identify.predict import run, shown, true_first_state
from identify.reduction import reduce
from identify.stretch import Stretch
from identify.structure import Structure
from identify.term import Term
from identify.windows import Problem, moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def _accelerations(_: Setting, __: Variant) -> dict[str, Term]:
    return {"surge": Term("u", "1", "bias"), "sway": Term("v", "1", "bias"), "yaw": Term("r", "1", "bias")}


#: Constant accelerations: what any structural error looks like for a while.
DISTURBANCE = Effect(
    "disturbance", "hull", "u̇ += a_u, v̇ += a_v, ṙ += a_r",
    "Constant accelerations that nothing accounts for.", "", "disturbance observers; Fossen 2011, sec. 8.1",
    terms=_accelerations,
)  # fmt: skip


@dataclass(frozen=True)
class Surprise:
    """A block's statistics.

    Attributes
    ----------
    start, end : float
        Of the block, s.
    size, freedom : float
        Squared whitened errors, and their expectation.
    slow, slow_freedom : float
        What constant accelerations explain, with errors as they are at low frequency, and its expectation.
    acceleration : (3,)
        Those accelerations, m/s², m/s², rad/s².
    """

    start: float
    end: float
    size: float
    freedom: float
    slow: float
    slow_freedom: float
    acceleration: FloatArray


def surprise(structure: Structure, known: Estimate, stretch: Stretch, noise: Noise) -> Surprise | None:
    """The statistics of a block; None where there is too little in it, or the prediction ran away.

    The parameters are moved to where block and knowledge together want them: where they are poorly known a first-order
    step would not do.
    """
    nothing = Prior(np.zeros(len(known.p)), np.full(len(known.p), np.inf))
    past = Knowledge(known.information, known.information @ known.p, known.information)
    moved, solution = update(Horizon(structure, nothing, known.p, noise, past), stretch)
    problem = problem_of(moved.windows, noise)
    if not np.isfinite(solution.cost) or problem.rows < 2 * NX:
        return None
    states = int((np.diag(solution.moments.matrices[0])[:NX] > 0).sum())
    size = solution.cost + float(known.p @ known.information @ known.p)
    slow, acceleration = _slow(structure, known, problem.dispersed, solution.p, moved.first)
    return Surprise(
        stretch.start, stretch.start + stretch.steps * stretch.h, max(size, 0.0), problem.rows - states,
        slow, 3.0, acceleration,
    )  # fmt: skip


def _slow(
    structure: Structure, known: Estimate, problem: Problem, p: FloatArray, first: FloatArray
) -> tuple[float, FloatArray]:
    """Gain of constant accelerations, the other parameters free within what is known of them."""
    wide = structure.with_effect(Active(DISTURBANCE))
    mine = np.array([s.effect == len(structure.actives) for s in wide.slots])
    found = moments(problem, wide, wide.carried(p, structure), first)
    reduced = reduce(found.matrices, first, first, state_precision(structure))
    information, score = reduced.information[0], reduced.score[0]
    base = information[np.ix_(~mine, ~mine)] + known.information
    pull = score[~mine] - known.information @ (p - known.p)
    follow = np.linalg.solve(base, np.column_stack([information[np.ix_(~mine, mine)], pull]))
    left = information[np.ix_(mine, mine)] - information[np.ix_(mine, ~mine)] @ follow[:, :-1]
    rest = score[mine] - information[np.ix_(mine, ~mine)] @ follow[:, -1]
    step = np.linalg.solve(left, rest)
    return max(float(rest @ step), 0.0), step


def ahead(structure: Structure, p: FloatArray, stretch: Stretch, first: int, steps: int) -> FloatArray:
    """Prediction error (6,) after ``steps`` of x, y, ψ, u, v, r: from the observed state at grid point ``first``.

    The error is what was observed less what the model says the sensors show.
    """
    d = drive(structure, p, stretch)
    begin = true_first_state(structure, d, stretch, first)
    path = run(structure, d, stretch, begin, first, steps)
    with np.errstate(over="ignore", invalid="ignore"):
        said = shown(structure, d, stretch, path)[-1]
    return np.asarray(stretch.states[first + steps] - said, dtype=float)
