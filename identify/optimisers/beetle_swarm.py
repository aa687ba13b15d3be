"""Beetle swarm antennae search, BSAS (Wang and Chen 2018)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .state import FloatArray, Optimiser, State, StopReason, common


@dataclass(frozen=True)
class BeetleState(State):
    """Where the swarm is, in the unit box, and how far it feels and steps.

    Attributes
    ----------
    centre : (d,)
    directions : (n, d)
        Of the beetles' antennae in this iteration.
    toward : (n,)
        Which antenna found less: +1 the left, -1 the right, 0 neither.
    """

    population: int
    step: float
    smallest_step: float
    reach: float
    attenuation: float
    patience: float
    phase: Literal["first", "antennae", "beetles"]
    centre: FloatArray
    value: float
    directions: FloatArray
    toward: FloatArray


def start(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    population: int = 8,
    step: float = 0.5,
    smallest_step: float = 1e-6,
    reach: float = 0.5,
    attenuation: float | None = None,
    patience: float = 0.5,
) -> BeetleState:
    """Begin a swarm.

    Parameters
    ----------
    population : int
        Beetles, each with its own direction (Xie et al. 2020: 4).
    step, smallest_step : float
        First and last step, as a share of the bounds' width.
    reach : float
        Length of the antennae over the step.
    attenuation, patience : float
        Where no beetle found better, the step shrinks by this factor with the probability ``patience``. The
        factor follows from the budget where it is absent (the paper: 0.9, for 20 iterations).
    """
    shared = common(bounds, seed)
    d = len(shared["bounds"])
    return BeetleState(
        **shared,
        population=population,
        step=step,
        smallest_step=smallest_step,
        reach=reach,
        attenuation=falling(attenuation, budget, 3 * population),
        patience=patience,
        phase="first",
        centre=np.full(d, 0.5),
        value=np.inf,
        directions=np.zeros((population, d)),
        toward=np.zeros(population),
    )


def propose(state: BeetleState, random: np.random.Generator) -> tuple[BeetleState, FloatArray]:
    """Ask for a start; then, by turns, for both antennae of every beetle, and for where they went."""
    if state.phase == "first":
        return state, random.random((state.population, len(state.bounds)))
    if state.phase == "antennae":
        state = replace(state, directions=directions(random, state.directions.shape))
        arm = state.reach * state.step * state.directions
        return state, np.vstack([state.centre + arm, state.centre - arm])
    return state, state.centre + state.step * state.toward[:, None] * state.directions


def falling(attenuation: float | None, budget: int | None, per_iteration: int) -> float:
    """Factor that takes the step down a thousandfold over two fifths of the budget; 0.9 without either."""
    if attenuation is not None or budget is None:
        return 0.9 if attenuation is None else attenuation
    iterations = max(0.4 * budget / per_iteration, 1.0)
    return float(np.clip(1e-3 ** (1 / iterations), 0.5, 0.99))


def directions(random: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """Draw directions (n, d) of unit length."""
    drawn = random.uniform(-1, 1, size=shape)
    return np.asarray(drawn / np.maximum(np.linalg.norm(drawn, axis=1, keepdims=True), 1e-300))


def learn(
    state: BeetleState, unit: FloatArray, values: FloatArray, random: np.random.Generator
) -> BeetleState:
    """Compare the antennae, or move the swarm."""
    if state.phase == "antennae":
        n = state.population
        left, right = values[:n], values[n:]
        toward = (left < right).astype(float) - (right < left).astype(float)
        return replace(state, toward=toward, phase="beetles")
    return _move(replace(state, phase="antennae"), unit, values, random)


def _move(
    state: BeetleState, unit: FloatArray, values: FloatArray, random: np.random.Generator
) -> BeetleState:
    best = int(np.argmin(values))
    if values[best] < state.value:
        return replace(state, centre=unit[best], value=float(values[best]))
    shrink = state.attenuation if random.random() < state.patience else 1.0
    return replace(state, step=state.step * shrink)


def stopped(state: BeetleState) -> StopReason | None:
    """Out of steps."""
    return StopReason.STEP if state.step < state.smallest_step else None


BSAS = Optimiser("bsas", start, propose, learn, stopped, "Wang and Chen 2018, arXiv 1807.10470")
