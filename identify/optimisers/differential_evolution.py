"""Differential evolution, rand/1/bin (Storn and Price 1997)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .state import FloatArray, Optimiser, State, StopReason, collapsed, common, scattered


@dataclass(frozen=True)
class EvolutionState(State):
    """The population in the unit box: points (n, d) and values (n,)."""

    population: int
    weight: tuple[float, float]
    crossover: float
    points: FloatArray
    values: FloatArray


def start(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    population: int | None = None,
    weight: tuple[float, float] = (0.5, 1.0),
    crossover: float = 0.9,
) -> EvolutionState:
    """Begin a population.

    Parameters
    ----------
    population : int, optional
        Two per variable where absent, 20 at least and 60 at most.
    weight : (float, float)
        Range from which the differential weight F is drawn anew in every generation (dither).
    crossover : float
        CR.
    """
    shared = common(bounds, seed)
    d = len(shared["bounds"])
    size = int(np.clip(2 * d, 20, 60)) if population is None else max(population, 4)
    return EvolutionState(**shared, population=size, weight=weight, crossover=crossover,
                          points=np.zeros((0, d)), values=np.zeros(0))  # fmt: skip


def propose(state: EvolutionState, random: np.random.Generator) -> tuple[EvolutionState, FloatArray]:
    """Scatter the population, then one trial vector for each of its members."""
    if len(state.values) == 0:
        return state, scattered(random, state.population, len(state.bounds))
    return state, _trials(state, random)


def _trials(state: EvolutionState, random: np.random.Generator) -> FloatArray:
    """Mutate and cross; what leaves the box is drawn anew between the base vector and the bound."""
    n, d = state.points.shape
    keys = random.random((n, n))
    np.fill_diagonal(keys, 2.0)
    a, b, c = np.argsort(keys, axis=1)[:, :3].T
    base = state.points[a]
    mutant = base + random.uniform(*state.weight) * (state.points[b] - state.points[c])
    bound = np.clip(mutant, 0.0, 1.0)
    mutant = np.where(mutant == bound, mutant, base + random.random((n, d)) * (bound - base))
    cross = random.random((n, d)) < state.crossover
    cross[np.arange(n), random.integers(d, size=n)] = True
    return np.where(cross, mutant, state.points)


def learn(
    state: EvolutionState, unit: FloatArray, values: FloatArray, _: np.random.Generator
) -> EvolutionState:
    """Each trial replaces its parent if it is no worse."""
    if len(state.values) == 0:
        return replace(state, points=unit, values=values)
    better = values <= state.values
    points = np.where(better[:, None], unit, state.points)
    return replace(state, points=points, values=np.where(better, values, state.values))


def stopped(state: EvolutionState) -> StopReason | None:
    """Converged when the population is one point."""
    if len(state.values) and collapsed(state.points, state.values):
        return StopReason.CONVERGED
    return None


DE = Optimiser("de", start, propose, learn, stopped, "Storn and Price 1997, rand/1/bin with dither")
