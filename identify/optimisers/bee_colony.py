"""Artificial bee colony (Karaboga 2005; Zhu et al. 2019, III.C)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .state import FloatArray, IntArray, Optimiser, State, StopReason, collapsed, common

Phase = Literal["first", "employed", "onlookers", "scouts"]
Selection = Literal["rank", "fitness"]


@dataclass(frozen=True)
class BeeState(State):
    """Food sources in the unit box, and how long each has not improved.

    Attributes
    ----------
    sources, values, trials : (n, d), (n,), (n,)
    asked : (m,)
        Source that each of the last candidates would replace.
    """

    population: int
    limit: int
    selection: Selection
    phase: Phase
    sources: FloatArray
    values: FloatArray
    trials: IntArray
    asked: IntArray


def start(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    population: int = 20,
    limit: int | None = None,
    selection: Selection = "rank",
) -> BeeState:
    """Begin a colony.

    Parameters
    ----------
    population : int
        Food sources, as many employed and as many onlooker bees (the paper: 20).
    limit : int, optional
        Trials without improvement after which a source is left; the paper's 30 or population × d, the larger.
    selection : {"rank", "fitness"}
        How onlookers choose. "fitness" is eq. 15 and 18 as printed, 1 / (1 + f), which cannot tell small
        values apart (ratios of 1.01 to 1.05 in the paper's own case); "rank" goes by order.
    """
    shared = common(bounds, seed)
    d = len(shared["bounds"])
    return BeeState(
        **shared,
        population=max(population, 2),
        limit=max(30, population * d) if limit is None else limit,
        selection=selection,
        phase="first",
        sources=np.zeros((0, d)),
        values=np.zeros(0),
        trials=np.zeros(0, dtype=np.int64),
        asked=np.arange(max(population, 2)),
    )


def propose(state: BeeState, random: np.random.Generator) -> tuple[BeeState, FloatArray]:
    """Candidates of the current phase."""
    n, d = state.population, len(state.bounds)
    asked = state.asked
    if state.phase == "onlookers":
        asked = random.choice(n, size=n, p=_probabilities(state))
    elif state.phase == "scouts":
        asked = np.flatnonzero(state.trials > state.limit)
    else:
        asked = np.arange(n)
    if state.phase in ("first", "scouts"):
        unit = random.random((len(asked), d))
    else:
        unit = _neighbours(state.sources, asked, random)
    return replace(state, asked=asked), unit


def _neighbours(sources: FloatArray, asked: IntArray, random: np.random.Generator) -> FloatArray:
    """Eq. 17: one variable of each source moved towards or away from another source."""
    n, d = sources.shape
    m = len(asked)
    other = (asked + random.integers(1, n, size=m)) % n
    variable = random.integers(d, size=m)
    unit, rows = sources[asked].copy(), np.arange(m)
    step = random.uniform(-1, 1, size=m)
    unit[rows, variable] += step * (unit[rows, variable] - sources[other, variable])
    return np.clip(unit, 0.0, 1.0)


def _probabilities(state: BeeState) -> FloatArray:
    if state.selection == "fitness":
        value = np.where(np.isfinite(state.values), state.values, np.finfo(float).max)
        fitness = np.where(value >= 0, 1 / (1 + np.maximum(value, 0)), 1 + np.abs(np.minimum(value, 0)))
    else:
        fitness = np.empty(state.population)
        fitness[np.argsort(state.values, kind="stable")] = np.arange(state.population, 0, -1.0)
    return np.asarray(fitness / fitness.sum())


def learn(state: BeeState, unit: FloatArray, values: FloatArray, _: np.random.Generator) -> BeeState:
    """Greedy choice between each source and its candidates, then the next phase."""
    if state.phase == "first":
        trials = np.zeros(len(unit), dtype=np.int64)
        return replace(state, phase="employed", sources=unit, values=values, trials=trials)
    if state.phase == "scouts":
        return replace(state, **_replaced(state, unit, values), phase="employed")
    after = replace(state, **_greedy(state, unit, values))
    if state.phase == "employed":
        return replace(after, phase="onlookers")
    exhausted = bool(np.any(after.trials > after.limit))
    return replace(after, phase="scouts" if exhausted else "employed")


def _replaced(state: BeeState, unit: FloatArray, values: FloatArray) -> dict[str, Any]:
    sources, kept, trials = state.sources.copy(), state.values.copy(), state.trials.copy()
    sources[state.asked], kept[state.asked], trials[state.asked] = unit, values, 0
    return {"sources": sources, "values": kept, "trials": trials}


def _greedy(state: BeeState, unit: FloatArray, values: FloatArray) -> dict[str, Any]:
    """Let the best of several bees at a source count; one that nobody improved has a trial more per bee."""
    order = np.argsort(-values, kind="stable")
    challenger, challenge = state.sources.copy(), np.full(state.population, np.inf)
    challenger[state.asked[order]], challenge[state.asked[order]] = unit[order], values[order]
    better = challenge < state.values
    visits = np.bincount(state.asked, minlength=state.population)
    return {
        "sources": np.where(better[:, None], challenger, state.sources),
        "values": np.where(better, challenge, state.values),
        "trials": np.where(better, 0, state.trials + visits),
    }


def stopped(state: BeeState) -> StopReason | None:
    """Converged when all sources are one."""
    if len(state.values) and collapsed(state.sources, state.values):
        return StopReason.CONVERGED
    return None


ABC = Optimiser(
    "abc", start, propose, learn, stopped, "Karaboga 2005; Zhu et al. 2019, eq. 14-18, selection by rank"
)
