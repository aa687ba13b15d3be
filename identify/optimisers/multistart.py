"""Quasi-Newton descent (BFGS, projected on the bounds) from many starts at once.

The starts take their steps together: all their differences, or all their trial lengths, are one population.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .state import BoolArray, FloatArray, Optimiser, State, StopReason, common, scattered

DIFFERENCE = 6e-6  # of central differences, in the unit box: the cube root of the precision
LENGTHS = np.array([4.0, 1.0, 0.5, 0.2, 0.05, 0.005])  # tried along each direction at once
SMALLEST_STEP = 1e-11
SMALLEST_SQUARE = float(np.finfo(float).tiny)  # of a change of the gradient: below it digits are lost
SMALLEST_DROP = 1e-15  # of the value in one step, over the spread of the first values


@dataclass(frozen=True)
class DescentState(State):
    """The starts in the unit box.

    Attributes
    ----------
    spread : float
        Of the first, scattered values.
    points, values, gradients : (n, d), (n,), (n, d)
    inverse : (n, d, d)
        Estimates of the inverse Hessian.
    previous_points, previous_gradients : (n, d)
        Before the last step; NaN where there was none.
    directions : (n, d)
    fresh : (n,)
        Whether the inverse Hessian is a first guess.
    active : (n,)
        Whether the start is still on its way.
    """

    starts: int
    samples: int
    spread: float
    phase: Literal["first", "differences", "lengths"]
    points: FloatArray
    values: FloatArray
    gradients: FloatArray
    inverse: FloatArray
    previous_points: FloatArray
    previous_gradients: FloatArray
    directions: FloatArray
    fresh: BoolArray
    active: BoolArray


def start(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    starts: int = 8,
    samples: int = 10,
) -> DescentState:
    """Begin.

    Parameters
    ----------
    starts : int
        Descents.
    samples : int
        Points scattered per start, of which the best are the starts.
    """
    shared = common(bounds, seed)
    n, d = starts, len(shared["bounds"])
    if budget is not None:
        samples = max(1, min(samples, budget // (4 * starts)))
    return DescentState(
        **shared,
        starts=n,
        samples=samples,
        spread=0.0,
        phase="first",
        points=np.zeros((n, d)),
        values=np.full(n, np.inf),
        gradients=np.zeros((n, d)),
        inverse=np.zeros((n, d, d)),
        previous_points=np.full((n, d), np.nan),
        previous_gradients=np.full((n, d), np.nan),
        directions=np.zeros((n, d)),
        fresh=np.ones(n, dtype=bool),
        active=np.ones(n, dtype=bool),
    )


def propose(state: DescentState, random: np.random.Generator) -> tuple[DescentState, FloatArray]:
    """Scattered points, then, by turns, the differences and the trial lengths of all starts on their way."""
    if state.phase == "first":
        return state, scattered(random, state.starts * state.samples, len(state.bounds))
    unit = _stencil(state) if state.phase == "differences" else _trials(state)
    return state, unit.reshape(-1, len(state.bounds))


def _stencil(state: DescentState) -> FloatArray:
    """Points to both sides in every variable, inside the box, (2, a, d, d)."""
    points = state.points[state.active][:, None, :]
    step = DIFFERENCE * np.eye(points.shape[-1])
    return np.clip(np.stack([points + step, points - step]), 0.0, 1.0)


def _trials(state: DescentState) -> FloatArray:
    """Points along the directions, (a, lengths, d)."""
    points, directions = state.points[state.active], state.directions[state.active]
    return np.clip(points[:, None, :] + LENGTHS[:, None] * directions[:, None, :], 0.0, 1.0)


def learn(state: DescentState, unit: FloatArray, values: FloatArray, _: np.random.Generator) -> DescentState:
    """Choose the starts, or compute directions, or step."""
    if state.phase == "first":
        best = np.argsort(values, kind="stable")[: state.starts]
        active = np.isfinite(values[best])
        spread = float(np.ptp(values[np.isfinite(values)])) if active.any() else 0.0
        first = replace(state, points=unit[best], values=values[best], active=active, spread=spread)
        return replace(first, phase="differences")
    if state.phase == "differences":
        return _directed(_differentiated(state, unit, values))
    return _stepped(state, unit, values)


def _differentiated(state: DescentState, unit: FloatArray, values: FloatArray) -> DescentState:
    """Gradients by central differences; one-sided next to a bound or to a value that is not finite."""
    d = len(state.bounds)
    sides = values.reshape(2, -1, d)
    places = np.einsum("sajj->saj", unit.reshape(2, -1, d, d))
    here, centre = state.points[state.active], state.values[state.active][:, None]
    good = np.isfinite(sides)
    sides, places = np.where(good, sides, centre), np.where(good, places, here)
    width = places[0] - places[1]
    slope = np.divide(sides[0] - sides[1], width, out=np.zeros_like(width), where=width > 0)
    gradients = state.gradients.copy()
    gradients[state.active] = slope
    return replace(state, gradients=gradients)


def _directed(state: DescentState) -> DescentState:
    """BFGS update, and the descent directions that do not leave the box."""
    state = _updated(state)
    x, g = state.points, state.gradients
    free = ~(((x <= 0) & (g > 0)) | ((x >= 1) & (g < 0)))
    slope = np.where(free, g, 0.0)
    inverse = np.where(state.fresh[:, None, None], _first_guess(slope), state.inverse)
    directions = np.where(free, -np.einsum("nij,nj->ni", inverse, slope), 0.0)
    uphill = np.einsum("ni,ni->n", directions, slope) >= 0
    inverse = np.where(uphill[:, None, None], _first_guess(slope), inverse)
    directions = np.where(uphill[:, None], -np.einsum("nij,nj->ni", inverse, slope), directions)
    moving = np.abs(directions).max(axis=1) > SMALLEST_STEP
    return replace(
        state,
        inverse=inverse,
        directions=directions,
        fresh=state.fresh | uphill,
        active=state.active & moving,
        phase="lengths" if np.any(state.active & moving) else "differences",
    )


def _first_guess(slope: FloatArray) -> FloatArray:
    """Inverse Hessians that make the first step a tenth of the box."""
    norm = np.maximum(np.linalg.norm(slope, axis=1), 1e-300)
    return np.asarray((0.1 / norm)[:, None, None] * np.eye(slope.shape[1]))


def _updated(state: DescentState) -> DescentState:
    """Nocedal and Wright 2006, eq. 6.17, for all starts; skipped where the curvature is not positive."""
    s, y = state.points - state.previous_points, state.gradients - state.previous_gradients
    with np.errstate(invalid="ignore"):
        curvature = np.einsum("ni,ni->n", s, y)
        sound = curvature > 1e-12 * np.linalg.norm(s, axis=1) * np.linalg.norm(y, axis=1)
    sound &= state.active
    s, y = np.where(sound[:, None], s, 0.0), np.where(sound[:, None], y, 0.0)
    square = np.einsum("ni,ni->n", y, y)
    sound &= np.minimum(curvature, square) > SMALLEST_SQUARE
    rho = np.divide(1.0, curvature, out=np.zeros_like(curvature), where=sound)
    scale = np.divide(curvature, square, out=np.zeros_like(curvature), where=sound)
    eye = np.eye(s.shape[1])
    first = (state.fresh & sound)[:, None, None]
    inverse = np.where(first, scale[:, None, None] * eye, state.inverse)
    left = eye - rho[:, None, None] * np.einsum("ni,nj->nij", s, y)
    update = np.einsum("nij,njk,nlk->nil", left, inverse, left)
    update += rho[:, None, None] * np.einsum("ni,nj->nij", s, s)
    inverse = np.where(sound[:, None, None], update, inverse)
    return replace(state, inverse=inverse, fresh=state.fresh & ~sound)


def _stepped(state: DescentState, unit: FloatArray, values: FloatArray) -> DescentState:
    """Take the best trial length; without one, begin anew with the gradient, and then stop."""
    d = len(state.bounds)
    trials, found = unit.reshape(-1, len(LENGTHS), d), values.reshape(-1, len(LENGTHS))
    index, best = np.flatnonzero(state.active), np.argmin(found, axis=1)
    rows = np.arange(len(index))
    drop = np.where(np.isfinite(found[rows, best]), state.values[index] - found[rows, best], -np.inf)
    lower = drop > SMALLEST_DROP * state.spread
    points, kept = state.points.copy(), state.values.copy()
    points[index[lower]], kept[index[lower]] = trials[rows, best][lower], found[rows, best][lower]
    done = index[~lower & state.fresh[index]]
    active, fresh = state.active.copy(), state.fresh.copy()
    active[done] = False
    fresh[index[~lower]] = True
    before = np.where(np.isin(np.arange(len(points)), index[lower])[:, None], state.points, np.nan)
    return replace(
        state,
        points=points,
        values=kept,
        active=active,
        fresh=fresh,
        previous_points=before,
        previous_gradients=state.gradients,
        phase="differences",
    )


def stopped(state: DescentState) -> StopReason | None:
    """Converged when no start is on its way."""
    return None if state.phase == "first" or state.active.any() else StopReason.CONVERGED


MULTISTART = Optimiser(
    "multistart", start, propose, learn, stopped, "Nocedal and Wright 2006, ch. 6, projected"
)
