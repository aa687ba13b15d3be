"""Adaptive beetle swarm antennae search, ABSAS (Xie et al. 2020, eq. 30-33)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .beetle_swarm import directions, falling
from .state import FloatArray, Optimiser, State, StopReason, common

SHARPNESS = 4.0  # exponent between the best and the worst antenna of the swarm


@dataclass(frozen=True)
class AdaptiveBeetleState(State):
    """Beetles with what their antennae remember, in the unit box.

    Attributes
    ----------
    centres, centre_values : (n, d), (n,)
        Where each beetle is.
    antennae, antenna_values : (2, n, d), (2, n)
        Best that its left and its right antenna have met.
    steps : (n,)
        How far each explores.
    """

    population: int
    constant: float
    smallest_step: float
    attenuation: float
    phase: Literal["first", "antennae", "beetles"]
    centres: FloatArray
    centre_values: FloatArray
    antennae: FloatArray
    antenna_values: FloatArray
    steps: FloatArray


def start(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    population: int = 8,
    constant: float = 1.1,
    step: float = 0.5,
    smallest_step: float = 1e-6,
    attenuation: float | None = None,
) -> AdaptiveBeetleState:
    """Begin a swarm.

    Parameters
    ----------
    population : int
        Beetles (the paper: 4).
    constant : float
        c of eq. 31, the sum of the two learning factors.
    step, smallest_step : float
        First and last exploring step, as a share of the bounds' width (the first is not in the paper).
    attenuation : float
        By which the step of a beetle shrinks when neither of its antennae found better; from the budget where
        absent (the paper: 0.9, for 20 iterations).
    """
    shared = common(bounds, seed)
    d = len(shared["bounds"])
    antennae = np.stack([np.zeros((population, d)), np.ones((population, d))])
    return AdaptiveBeetleState(
        **shared,
        population=population,
        constant=constant,
        smallest_step=smallest_step,
        attenuation=falling(attenuation, budget, 3 * population),
        phase="first",
        centres=np.zeros((population, d)),
        centre_values=np.full(population, np.inf),
        antennae=antennae,
        antenna_values=np.full((2, population), np.inf),
        steps=np.full(population, step),
    )


def propose(
    state: AdaptiveBeetleState, random: np.random.Generator
) -> tuple[AdaptiveBeetleState, FloatArray]:
    """Ask for the bounds' corners and the first centres; then, by turns, for the antennae and the centres."""
    d = len(state.bounds)
    if state.phase == "first":
        return state, np.vstack([np.zeros((1, d)), np.ones((1, d)), random.random((state.population, d))])
    if state.phase == "antennae":
        arm = state.steps[:, None] * directions(random, (state.population, d))
        return state, np.vstack([state.antennae[0] + arm, state.antennae[1] - arm])
    return state, _learned(state, random)


def _learned(state: AdaptiveBeetleState, random: np.random.Generator) -> FloatArray:
    """Eq. 31: each centre moves towards what its antennae remember, the better one first.

    As printed, exp(f) of values near zero gives both antennae the same weight whatever they found. Here the
    exponent is the rank among all antennae of the swarm, which does not depend on the values' scale.
    """
    rank = np.empty(2 * state.population)
    rank[np.argsort(state.antenna_values.ravel(), kind="stable")] = np.linspace(0, 1, 2 * state.population)
    left, right = rank.reshape(2, -1)
    factor_left = state.constant / (1 + np.exp(SHARPNESS * (left - right)))
    factor = np.stack([factor_left, state.constant - factor_left])
    pull = random.random(state.population) * factor
    moved = state.centres + np.sum(pull[:, :, None] * (state.antennae - state.centres), axis=0)
    return np.asarray(moved)


def learn(
    state: AdaptiveBeetleState, unit: FloatArray, values: FloatArray, _: np.random.Generator
) -> AdaptiveBeetleState:
    """Remember what was better."""
    if state.phase == "first":
        corners = np.repeat(values[:2, None], state.population, axis=1)
        found: dict[str, Any] = {"centres": unit[2:], "centre_values": values[2:], "antenna_values": corners}
        return replace(state, **found, phase="antennae")
    if state.phase == "beetles":
        return replace(state, centres=unit, centre_values=values, phase="antennae")
    return replace(state, **_felt(state, unit, values), phase="beetles")


def _felt(state: AdaptiveBeetleState, unit: FloatArray, values: FloatArray) -> dict[str, Any]:
    """Eq. 30: each antenna's historical optimum; the step shrinks where neither improved."""
    points, found = unit.reshape(state.antennae.shape), values.reshape(state.antenna_values.shape)
    better = found < state.antenna_values
    shrunk = np.maximum(state.steps * state.attenuation, state.smallest_step)
    return {
        "antennae": np.where(better[:, :, None], points, state.antennae),
        "antenna_values": np.where(better, found, state.antenna_values),
        "steps": np.where(better.any(axis=0), state.steps, shrunk),
    }


def stopped(state: AdaptiveBeetleState) -> StopReason | None:
    """Out of steps."""
    return StopReason.STEP if float(state.steps.max()) <= state.smallest_step else None


ABSAS = Optimiser(
    "absas",
    start,
    propose,
    learn,
    stopped,
    "Xie et al. 2020, eq. 30-33, weights by rank, kept inside the bounds",
)
