"""Ant colony for continuous domains, ACO_R (Socha and Dorigo 2008; Zhao and Li 2021, 3.2)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .state import FloatArray, Optimiser, State, StopReason, collapsed, common


@dataclass(frozen=True)
class AntState(State):
    """The archive, best first, in the unit box.

    Attributes
    ----------
    archive, values : (k, d), (k,)
    """

    size: int
    population: int
    q: float
    xi: float
    archive: FloatArray
    values: FloatArray


def start(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    population: int = 30,
    archive: int = 50,
    q: float = 0.1,
    xi: float = 0.85,
) -> AntState:
    """Begin a colony.

    Parameters
    ----------
    population : int
        Ants per generation, m.
    archive : int
        Solutions that are remembered, k.
    q : float
        Locality: small prefers the best. The paper's 1e-3 with k = 15 makes the choice purely greedy.
    xi : float
        Speed of convergence: the larger, the slower.
    """
    shared = common(bounds, seed)
    d = len(shared["bounds"])
    return AntState(**shared, size=max(archive, 2), population=population, q=q, xi=xi,
                    archive=np.zeros((0, d)), values=np.zeros(0))  # fmt: skip


def propose(state: AntState, random: np.random.Generator) -> tuple[AntState, FloatArray]:
    """Scatter the first archive, then sample around its members."""
    if len(state.values) == 0:
        return state, random.random((state.size, len(state.bounds)))
    return state, _construct(state, random)


def _construct(state: AntState, random: np.random.Generator) -> FloatArray:
    """Eq. 22-25, with (x - μ)² / 2σ² in the exponent of eq. 24: each ant samples around one guide."""
    rank = np.arange(state.size)
    weight = np.exp(-(rank**2) / (2 * (state.q * state.size) ** 2))
    guide = random.choice(state.size, size=state.population, p=weight / weight.sum())
    distance = np.abs(state.archive[None, :, :] - state.archive[guide][:, None, :])
    sigma = state.xi * distance.sum(axis=1) / (state.size - 1)
    unit = random.normal(state.archive[guide], sigma)
    return np.clip(unit, 0.0, 1.0)


def learn(state: AntState, unit: FloatArray, values: FloatArray, _: np.random.Generator) -> AntState:
    """Keep the best k of the archive and the new ones."""
    everyone = np.vstack([state.archive, unit])
    ranks = np.concatenate([state.values, values])
    best = np.argsort(ranks, kind="stable")[: state.size]
    return replace(state, archive=everyone[best], values=ranks[best])


def stopped(state: AntState) -> StopReason | None:
    """Converged when the whole archive is one point."""
    if len(state.values) and collapsed(state.archive, state.values):
        return StopReason.CONVERGED
    return None


ACO_R = Optimiser(
    "aco_r",
    start,
    propose,
    learn,
    stopped,
    "Socha and Dorigo 2008; Zhao and Li 2021, eq. 22-25, Gaussian corrected",
)
