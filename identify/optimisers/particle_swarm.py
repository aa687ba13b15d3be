"""Particle swarms: constant inertia, and inertia that falls linearly (LDWPSO)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .state import FloatArray, Optimiser, State, StopReason, collapsed, common

GENERATIONS = 100  # of the falling inertia, where no budget says


@dataclass(frozen=True)
class SwarmState(State):
    """Particles in the unit box.

    Attributes
    ----------
    points, velocities, own, own_values : (n, d), (n, d), (n, d), (n,)
        Where each particle is, how it moves, and the best place it has been.
    inertia : (2,)
        First and last; ``horizon`` generations from the one to the other.
    """

    population: int
    inertia: FloatArray
    horizon: int
    cognitive: float
    social: float
    fastest: float
    points: FloatArray
    velocities: FloatArray
    own: FloatArray
    own_values: FloatArray


def start(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    population: int = 20,
    inertia: float = 0.7298,
    cognitive: float = 1.49618,
    social: float = 1.49618,
    fastest: float = 0.5,
) -> SwarmState:
    """Begin a swarm with constant inertia (Clerc and Kennedy 2002).

    Parameters
    ----------
    inertia, cognitive, social : float
        w, c1, c2.
    fastest : float
        Largest velocity, as a share of the bounds' width.
    """
    return _begin(bounds, seed, population, (inertia, inertia), GENERATIONS, (cognitive, social, fastest))


def start_falling(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    population: int = 20,
    inertia: tuple[float, float] = (1.0, 0.4),
    cognitive: float = 1.6,
    social: float = 1.8,
    fastest: float = 0.5,
    generations: int | None = None,
) -> SwarmState:
    """Begin a swarm whose inertia falls linearly (Xie et al. 2020, table 2: 1 - 0.6 i / N, c1 1.6, c2 1.8).

    Parameters
    ----------
    generations : int, optional
        N; from the budget where absent.
    """
    if generations is None:
        generations = GENERATIONS if budget is None else max(budget // population, 1)
    return _begin(bounds, seed, population, inertia, generations, (cognitive, social, fastest))


def _begin(
    bounds: ArrayLike,
    seed: int,
    population: int,
    inertia: tuple[float, float],
    horizon: int,
    constants: tuple[float, float, float],
) -> SwarmState:
    shared = common(bounds, seed)
    empty = np.zeros((0, len(shared["bounds"])))
    return SwarmState(**shared, population=population, inertia=np.array(inertia), horizon=horizon,
                      cognitive=constants[0], social=constants[1], fastest=constants[2],
                      points=empty, velocities=empty, own=empty, own_values=np.zeros(0))  # fmt: skip


def propose(state: SwarmState, random: np.random.Generator) -> tuple[SwarmState, FloatArray]:
    """Scatter the particles, then move them; at a bound a particle loses that part of its velocity."""
    shape = (state.population, len(state.bounds))
    if len(state.own_values) == 0:
        points = random.random(shape)
        velocities = random.uniform(-0.5, 0.5, size=shape) * state.fastest
    else:
        points, velocities = _moved(state, random)
    return replace(state, points=points, velocities=velocities), points


def _moved(state: SwarmState, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    done = min(state.generations / state.horizon, 1.0)
    inertia = state.inertia[0] + (state.inertia[1] - state.inertia[0]) * done
    best = state.own[np.argmin(state.own_values)]
    own_pull = state.cognitive * random.random(state.points.shape) * (state.own - state.points)
    swarm_pull = state.social * random.random(state.points.shape) * (best - state.points)
    velocities = inertia * state.velocities + own_pull + swarm_pull
    velocities = np.clip(velocities, -state.fastest, state.fastest)
    points = np.clip(state.points + velocities, 0.0, 1.0)
    outside = (points <= 0.0) | (points >= 1.0)
    return points, np.where(outside, 0.0, velocities)


def learn(state: SwarmState, unit: FloatArray, values: FloatArray, _: np.random.Generator) -> SwarmState:
    """Remember each particle's best."""
    if len(state.own_values) == 0:
        return replace(state, points=unit, own=unit, own_values=values)
    better = values < state.own_values
    own = np.where(better[:, None], unit, state.own)
    return replace(state, points=unit, own=own, own_values=np.where(better, values, state.own_values))


def stopped(state: SwarmState) -> StopReason | None:
    """Converged when all particles' best places are one."""
    if len(state.own_values) and collapsed(state.own, state.own_values):
        return StopReason.CONVERGED
    return None


PSO = Optimiser("pso", start, propose, learn, stopped, "Kennedy and Eberhart 1995; Clerc and Kennedy 2002")
LDWPSO = Optimiser(
    "ldwpso", start_falling, propose, learn, stopped, "Shi and Eberhart 1998; Xie et al. 2020, table 2"
)
