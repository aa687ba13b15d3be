"""CMA-ES, by the library ``cma`` (Hansen 2016), as a state that can be saved."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .state import FloatArray, Optimiser, State, StopReason, common, from_unit, to_unit


@dataclass(frozen=True)
class CmaState(State):
    """The library's strategy, pickled, and what it asked last (unit box).

    ``spread`` is that of the first generation's values, by which all are divided: the library's tolerances
    are absolute, and a search must not depend on the unit of its objective.
    """

    engine: bytes
    asked: FloatArray
    spread: float
    restarts: int
    finished: bool


class _Normal:
    """Source of normal numbers that is pickled with the strategy, so that no global one is used."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def __call__(self, *shape: int) -> FloatArray:
        return self.random.standard_normal(shape)


def start(
    bounds: ArrayLike,
    seed: int,
    *,
    budget: int | None = None,
    population: int | None = None,
    sigma: float = 0.3,
    restarts: int = 0,
    x0: ArrayLike | None = None,
) -> CmaState:
    """Begin a strategy.

    Parameters
    ----------
    population : int, optional
        4 + 3 ln d where absent.
    sigma : float
        First standard deviation, as a share of the bounds' width.
    restarts : int
        Times that it begins anew, from elsewhere and with twice the population, when it has converged (IPOP).
    x0 : (d,), optional
        First mean; the middle where absent.
    """
    shared = common(bounds, seed)
    d = len(shared["bounds"])
    state = CmaState(
        **shared,
        engine=b"",
        asked=np.zeros((0, d)),
        spread=0.0,
        restarts=restarts,
        finished=False,
    )
    middle = np.full(d, 0.5) if x0 is None else to_unit(state, np.asarray(x0, dtype=float))
    return replace(state, engine=_engine(np.clip(middle, 0.0, 1.0), sigma, population, seed))


def _engine(mean: FloatArray, sigma: float, population: int | None, seed: int) -> bytes:
    """Make a new strategy; one variable gets an idle second, which the library needs."""
    import cma

    options: dict[str, Any] = {"bounds": [0, 1], "verbose": -9, "seed": np.nan, "randn": _Normal(seed)}
    if population is not None:
        options["popsize"] = population
    padded = mean if len(mean) > 1 else np.append(mean, 0.5)
    return pickle.dumps(cma.CMAEvolutionStrategy(padded, sigma, options))


def propose(state: CmaState, _: np.random.Generator) -> tuple[CmaState, FloatArray]:
    """Sample one generation."""
    strategy = pickle.loads(state.engine)
    asked = np.array(strategy.ask())
    return replace(state, engine=pickle.dumps(strategy), asked=asked), asked[:, : len(state.bounds)]


def learn(state: CmaState, unit: FloatArray, values: FloatArray, random: np.random.Generator) -> CmaState:
    """Adapt mean, step and covariance."""
    spread = state.spread or _spread(values)
    strategy = pickle.loads(state.engine)
    strategy.tell(list(_as_asked(state, unit)), list(_ranked(values / (spread or 1.0))))
    after = replace(state, engine=pickle.dumps(strategy), spread=spread)
    if not strategy.stop():
        return after
    if state.restarts == 0:
        return replace(after, finished=True)
    return _restarted(after, strategy.popsize, random)


def _as_asked(state: CmaState, unit: FloatArray) -> FloatArray:
    """Return what was asked, where the points are those inside the bounds; else the points themselves."""
    d = len(state.bounds)
    if np.array_equal(to_unit(state, from_unit(state, state.asked[:, :d])), unit):
        return state.asked
    return unit if d > 1 else np.column_stack([unit, np.full(len(unit), 0.5)])


def _spread(values: FloatArray) -> float:
    good = values[np.isfinite(values)]
    return float(np.ptp(good)) if len(good) else 0.0


def _ranked(values: FloatArray) -> FloatArray:
    """Values with the infinite ones just above the worst finite one."""
    good = values[np.isfinite(values)]
    worst = float(good.max()) if len(good) else 1.0
    return np.where(np.isfinite(values), values, worst + abs(worst) + 1.0)


def _restarted(state: CmaState, population: int, random: np.random.Generator) -> CmaState:
    mean = random.random(len(state.bounds))
    engine = _engine(mean, 0.3, 2 * population, int(random.integers(2**31)))
    return replace(state, engine=engine, restarts=state.restarts - 1)


def stopped(state: CmaState) -> StopReason | None:
    """Converged by the library's own criteria."""
    return StopReason.CONVERGED if state.finished else None


CMAES = Optimiser(
    "cmaes", start, propose, learn, stopped, "Hansen 2016, arXiv 1604.00772, by the library cma"
)
