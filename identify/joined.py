"""Whole logs fitted free-running, by windows that are joined ever more firmly.

Where a vessel is unstable on course, the error of a free run over a whole log has countless valleys, and a search over
long windows goes nowhere. Here every log is cut into short windows with first states of their own, and the jump from
the end of each window to the beginning of the next is penalised: lightly at first, so that the search goes easily, then
ever more, until what is left is one free run from the log's first state (multiple shooting; Bock 1983). Compared are u,
v and r, each in units of how much it varies in its own log: a gentle zigzag counts as much as a hard one.

The normal equations are banded in the windows' states, so the cost grows with the number of samples and no faster.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from identify.chain import Chain
from identify.output_error import Prior
from identify.pieces import Ready, paths_of, ready
from identify.stretch import IntArray
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: How much a state may jump between two windows, in units of its spread in the log: from loose to tight.
JUMPS = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3)
#: How well a log's first state is known, in units of the spread of u, v, r.
FIRST = 2e-3
#: Size of the errors that what is known beforehand is weighed against, in units of the spread. They are far from
#: independent, so they count much less than their number.
ERROR = 1.0


@dataclass(frozen=True)
class Joined:
    """Where a search ended: parameters ``p`` (np,), first states (pieces, 3) and the cost."""

    chain: Chain
    p: FloatArray
    first: FloatArray
    cost: float


@dataclass(frozen=True)
class _Normal:
    """Normal equations: band (6, 3 w) of the states, their coupling (3 w, np) and gradient, those of the parameters."""

    band: FloatArray
    coupling: FloatArray
    by_state: FloatArray
    information: FloatArray
    score: FloatArray
    cost: float


def join(
    chain: Chain,
    p: FloatArray,
    prior: Prior,
    first: FloatArray | None = None,
    *,
    jumps: Sequence[float] = JUMPS,
    budget: int = 15,
    tolerance: float = 1e-3,
) -> Joined | None:
    """Fit all stretches free-running.

    Parameters
    ----------
    chain : Chain
    p : (np,)
        Where to begin; parameters that are no coefficients stay where they are.
    prior : Prior
        Of the parameters.
    first : (pieces, 3), optional
        First u, v, r through the water of every piece; by default the smoothed ones.
    jumps : sequence of float
        From loose to tight.
    budget, tolerance
        Steps at each, and the share of the cost below which a gain is none.

    Returns
    -------
    Joined or None
        None where the prediction runs away at once.
    """
    stretches = ready(chain, p)
    now = Joined(chain, p, _smoothed(stretches) if first is None else first, np.inf)
    for jump in jumps:
        found = _settle(now, stretches, prior, jump, budget, tolerance)
        if found is None:
            return None
        now = found
    return now


def _settle(
    start: Joined, stretches: Sequence[Ready], prior: Prior, jump: float, budget: int, tolerance: float
) -> Joined | None:
    """Levenberg-Marquardt at one firmness of the joints."""
    chain, p, first, damping = start.chain, start.p, start.first, 1e-3
    now = _normal(chain, stretches, p, first, prior, jump)
    if now is None:
        return None
    for _ in range(budget):
        move, d_first = _step(now, damping)
        trial_p, trial_first = _moved(chain.structure, p, move), first + d_first
        trial = _normal(chain, stretches, trial_p, trial_first, prior, jump)
        if trial is not None and trial.cost < now.cost:
            gain = now.cost - trial.cost
            p, first, now, damping = trial_p, trial_first, trial, max(0.1 * damping, 1e-9)
            if gain < tolerance * now.cost:
                break
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    return Joined(chain, p, first, now.cost)


def _moved(structure: Structure, p: FloatArray, move: FloatArray) -> FloatArray:
    """``p`` with the coefficients moved, within their bounds."""
    out = p.copy()
    out[structure.simple] += move
    low, high = (np.array([s.parameter.bounds[k] for s in structure.slots]) for k in (0, 1))
    return np.asarray(np.clip(out, low, high), dtype=float)


def _smoothed(stretches: Sequence[Ready]) -> FloatArray:
    """First u, v, r (pieces, 3) of every piece, through the water, from the smoothed states."""
    return np.concatenate([s.smoothed for s in stretches])


def _step(now: _Normal, damping: float) -> tuple[FloatArray, FloatArray]:
    """Step of the parameters (np,) and of the first states (pieces, 3): the states eliminated by their band."""
    band = now.band.copy()
    band[0] *= 1.0 + damping
    solved = solveh_banded(band, np.column_stack([now.coupling, now.by_state]), lower=True)
    slope, free = solved[:, :-1], solved[:, -1]
    information = now.information - now.coupling.T @ slope
    score = now.score - now.coupling.T @ free
    scale = 1.0 / np.sqrt(np.maximum(np.diag(now.information), 1e-30))
    scaled = information * scale * scale[:, None] + damping * np.eye(len(score))
    move = scale * np.linalg.solve(scaled, scale * score)
    return move, (free - slope @ move).reshape(-1, 3)


def _normal(
    chain: Chain, stretches: Sequence[Ready], p: FloatArray, first: FloatArray, prior: Prior, jump: float
) -> _Normal | None:
    """Normal equations of measurements, joints, first states and priors; None where a prediction ran away."""
    paths = paths_of(stretches, p, first)
    if paths is None:
        return None
    n, m, simple = len(first), len(chain.structure.simple), chain.structure.simple
    spread = chain.spread[[w.stretch for w in chain.pieces]]
    opens = np.array([w.opens for w in chain.pieces])
    square = np.zeros((n, 6 + m, 6 + m))  # first state, coefficients, first state of the next piece
    toward = np.zeros((n, 6 + m))
    square[:, : 3 + m, : 3 + m], toward[:, : 3 + m] = paths.moment[:, :-1, :-1], paths.moment[:, :-1, -1]
    to_begin = np.zeros((int(opens.sum()), 3, 6 + m))
    to_begin[:, range(3), range(3)] = 1.0 / spread[opens]
    begin = (_smoothed(stretches) - first)[opens] / spread[opens]
    joint = np.nonzero(~opens[1:])[0]
    to_next = np.zeros((len(joint), 3, 6 + m))
    to_next[:, :, : 3 + m] = paths.slope[joint]
    to_next[:, range(3), range(3 + m, 6 + m)] = -1.0 / spread[joint]
    jumped = (first[joint + 1] - paths.end[joint]) / spread[joint]
    known = (ERROR / prior.sd[simple]) ** 2
    off = prior.mean[simple] - p[simple]
    cost = float(paths.moment[:, -1, -1].sum() + np.sum(known * off**2))
    cost += _add(square, toward, np.nonzero(opens)[0], to_begin, begin, FIRST)
    cost += _add(square, toward, joint, to_next, jumped, jump)
    diagonal, coupling, by_state = square[:, :3, :3], square[:, :3, 3 : 3 + m], toward[:, :3]
    diagonal[1:] += square[:-1, 3 + m :, 3 + m :]
    coupling[1:] += square[:-1, 3 + m :, 3 : 3 + m]
    by_state[1:] += toward[:-1, 3 + m :]
    return _Normal(
        _band(diagonal, square[:, 3 + m :, :3]), coupling.reshape(3 * n, m), by_state.ravel(),
        square[:, 3 : 3 + m, 3 : 3 + m].sum(axis=0) + np.diag(known),
        toward[:, 3 : 3 + m].sum(axis=0) + known * off, cost,
    )  # fmt: skip


def _add(
    square: FloatArray, toward: FloatArray, some: IntArray, rows: FloatArray, error: FloatArray, size: float
) -> float:
    """Add rows (k, 3, c) of some pieces that should bring an error (k, 3) of this size to nothing; their cost."""
    across = rows.transpose(0, 2, 1)
    square[some] += across @ rows / size**2
    toward[some] += (across @ error[:, :, None])[:, :, 0] / size**2
    return float(np.sum(error**2)) / size**2


def _band(diagonal: FloatArray, beside: FloatArray) -> FloatArray:
    """Lower band (6, 3 n) of a matrix with blocks (n, 3, 3) on and below its diagonal."""
    n = len(diagonal)
    column = np.concatenate([diagonal, beside], axis=1)  # (n, 6, 3): what stands below in each block column
    band = np.zeros((6, n, 3))
    for j in range(3):
        band[: 6 - j, :, j] = column[:, j:, j].T
    return band.reshape(6, 3 * n)
