"""What every optimiser shares: the state that can be saved, why a search stopped, the unit box."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


class StopReason(Enum):
    """Why a search ended; the value is the sentence for the report."""

    BUDGET = "The budget of evaluations was used up."
    TARGET = "The target value was reached."
    CONVERGED = "The candidates had converged to one point."
    STALLED = "The best value had stopped improving."
    STEP = "The step had become as small as it may."
    RESOLVED = "The grid had become as fine as asked."
    NOTHING_FINITE = "No candidate gave a finite value."


@dataclass(frozen=True)
class State:
    """What a search remembers; frozen and picklable, its random state included.

    Attributes
    ----------
    bounds : (d, 2)
        Lower and upper bound of each variable.
    random : mapping
        State of the random generator (PCG64).
    evaluations, generations : int
        Told so far.
    best_x, best_value : (d,), float
        Best so far; NaN and infinity before the first finite value.
    stale : int
        Generations since the best improved.
    """

    bounds: FloatArray
    random: Mapping[str, Any]
    evaluations: int
    generations: int
    best_x: FloatArray
    best_value: float
    stale: int


S = TypeVar("S", bound=State)


@dataclass(frozen=True)
class Optimiser(Generic[S]):
    """An optimiser by name, as four functions of a state.

    Attributes
    ----------
    start : callable
        ``start(bounds (d, 2), seed, *, budget=None, **options) -> state``; ``budget`` is what a schedule
        spreads over.
    propose : callable
        ``propose(state, random) -> (state, points (m, d))`` in the unit box; what is outside is put on its edge.
    learn : callable
        ``learn(state, points (m, d), values (m,), random) -> state``, the points in the unit box, values that are not
        finite as infinity; the shared fields of the state are up to date.
    stopped : callable
        ``stopped(state) -> StopReason or None``.
    source : str
        Where it is published, and what was corrected.
    """

    name: str
    start: Callable[..., S]
    propose: Callable[[S, np.random.Generator], tuple[S, FloatArray]]
    learn: Callable[[S, FloatArray, FloatArray, np.random.Generator], S]
    stopped: Callable[[S], StopReason | None]
    source: str = ""

    def ask(self, state: S) -> tuple[S, FloatArray]:
        """Candidates (m, d) inside the bounds, and the state that has asked them."""
        random = _generator(state)
        after, points = self.propose(state, random)
        return replace(after, random=_memory(random)), from_unit(state, points)

    def tell(self, state: S, candidates: FloatArray, values: FloatArray) -> S:
        """Take the values (m,) of candidates (m, d); one that is not finite counts as worst."""
        values, random = finite(values), _generator(state)
        told = replace(state, **_seen(state, candidates, values))
        after = self.learn(told, to_unit(state, candidates), values, random)
        return replace(after, random=_memory(random))


@dataclass(frozen=True)
class Minimum:
    """Outcome of a search.

    Attributes
    ----------
    x, value : (d,), float
        Best candidate and its value.
    history : (g, 2)
        Per generation: evaluations so far, best value so far.
    state : State
        To go on from.
    """

    x: FloatArray
    value: float
    evaluations: int
    stopped: StopReason
    history: FloatArray = field(repr=False)
    state: State = field(repr=False)


def common(bounds: ArrayLike, seed: int) -> dict[str, Any]:
    """First values of the shared fields.

    Raises
    ------
    ValueError
        Where a bound is not finite or the lower is above the upper.
    """
    box = np.array(bounds, dtype=float)
    if box.ndim != 2 or box.shape[1] != 2 or len(box) == 0:
        raise ValueError(f"expected bounds (d, 2), found {box.shape}")
    if not np.isfinite(box).all() or np.any(box[:, 0] > box[:, 1]):
        raise ValueError("bounds must be finite, lower before upper")
    return {
        "bounds": box,
        "random": np.random.PCG64(seed).state,
        "evaluations": 0,
        "generations": 0,
        "best_x": np.full(len(box), np.nan),
        "best_value": np.inf,
        "stale": 0,
    }


def _generator(state: State) -> np.random.Generator:
    """Make a generator that goes on from the state; its `_memory` goes into the next one."""
    bits = np.random.PCG64(0)
    bits.state = dict(state.random)  # type: ignore[assignment]
    return np.random.Generator(bits)


def _memory(random: np.random.Generator) -> Mapping[str, Any]:
    """State of a generator, to be saved."""
    return dict(random.bit_generator.state)


def from_unit(state: State, unit: FloatArray) -> FloatArray:
    """Candidates from the unit box, (m, d) to (m, d), clipped to the bounds."""
    low, high = state.bounds.T
    return np.asarray(np.clip(low + unit * (high - low), low, high))


def to_unit(state: State, candidates: FloatArray) -> FloatArray:
    """Candidates in the unit box; 0 where a variable is fixed."""
    low, high = state.bounds.T
    width = high - low
    return np.asarray((candidates - low) / np.where(width > 0, width, 1.0))


def finite(values: ArrayLike) -> FloatArray:
    """Values with infinity for those that are not finite."""
    array = np.asarray(values, dtype=float)
    return np.where(np.isfinite(array), array, np.inf)


def _seen(state: State, candidates: FloatArray, values: FloatArray) -> dict[str, Any]:
    """Shared fields after a generation of finite or infinite values."""
    place = int(np.argmin(values))
    better = bool(values[place] < state.best_value)
    return {
        "evaluations": state.evaluations + len(values),
        "generations": state.generations + 1,
        "best_x": candidates[place].copy() if better else state.best_x,
        "best_value": float(values[place]) if better else state.best_value,
        "stale": 0 if better else state.stale + 1,
    }


def never(state: State) -> StopReason | None:
    """Stop for no reason of its own."""
    return None


def scattered(random: np.random.Generator, count: int, dimension: int) -> FloatArray:
    """Draw points of the unit box, one in each of ``count`` slices of every variable (Latin hypercube)."""
    slices = random.permuted(np.tile(np.arange(count), (dimension, 1)), axis=1).T
    return np.asarray((slices + random.random((count, dimension))) / count)


def collapsed(points: FloatArray, values: FloatArray, tolerance: float = 1e-12) -> bool:
    """Whether all points (unit box) and their finite values have become one."""
    if not np.isfinite(values).all():
        return False
    return bool(np.ptp(points, axis=0).max() < tolerance)
