"""The one driver for all optimisers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .state import FloatArray, Minimum, Optimiser, State, StopReason, finite

Objective = Callable[[FloatArray], ArrayLike]


def minimise(
    optimiser: Optimiser[Any],
    objective: Objective,
    bounds: ArrayLike,
    budget: int,
    seed: int = 0,
    *,
    target: float = -np.inf,
    patience: int | None = None,
    watch: Callable[[State], None] | None = None,
    **options: Any,
) -> Minimum:
    """Minimise by ask and tell until the optimiser stops or the budget is used up.

    Parameters
    ----------
    objective : callable
        Values (m,) of a population (m, d); what is not finite counts as worst.
    bounds : (d, 2)
    budget : int
        Most evaluations; never exceeded.
    seed : int
        The same seed gives the same search.
    target : float
        Value at which to stop.
    patience : int, optional
        Generations without improvement after which to stop.
    watch : callable, optional
        Called with the state after each generation: for a progress bar, or to save it.
    **options
        Of the optimiser.
    """
    state = optimiser.start(bounds, seed, budget=budget, **options)
    return resume(optimiser, objective, state, budget, target=target, patience=patience, watch=watch)


def resume(
    optimiser: Optimiser[Any],
    objective: Objective,
    state: State,
    budget: int,
    *,
    target: float = -np.inf,
    patience: int | None = None,
    watch: Callable[[State], None] | None = None,
) -> Minimum:
    """Go on from a state, as `minimise`; ``budget`` counts the evaluations before it too."""
    if budget <= 0:
        raise ValueError(f"expected a budget of at least one evaluation, found {budget}")
    history: list[tuple[float, float]] = []
    reason = _reason(optimiser, state, budget, target, patience)
    while reason is None:
        state = generation(optimiser, objective, state, budget - state.evaluations)
        history.append((state.evaluations, state.best_value))
        if watch is not None:
            watch(state)
        reason = _reason(optimiser, state, budget, target, patience)
    if not np.isfinite(state.best_value):
        reason = StopReason.NOTHING_FINITE
    trace = np.array(history, dtype=float).reshape(-1, 2)
    return Minimum(state.best_x, state.best_value, state.evaluations, reason, trace, state)


def generation(optimiser: Optimiser[Any], objective: Objective, state: State, left: int) -> State:
    """Take one generation further; candidates beyond what is left of the budget are told as worst."""
    state, candidates = optimiser.ask(state)
    taken = min(left, len(candidates))
    values = np.full(len(candidates), np.inf)
    found = finite(objective(candidates[:taken]))
    if found.shape != (taken,):
        raise ValueError(f"expected one value for each of {taken} candidates, found shape {found.shape}")
    values[:taken] = found
    after: State = optimiser.tell(state, candidates, values)
    if taken < len(candidates):
        after = _count(after, len(candidates) - taken)
    return after


def _count(state: State, untried: int) -> State:
    return replace(state, evaluations=state.evaluations - untried)


def _reason(
    optimiser: Optimiser[Any], state: State, budget: int, target: float, patience: int | None
) -> StopReason | None:
    if state.best_value <= target:
        return StopReason.TARGET
    if state.evaluations >= budget:
        return StopReason.BUDGET
    if patience is not None and state.stale >= patience:
        return StopReason.STALLED
    return optimiser.stopped(state)
