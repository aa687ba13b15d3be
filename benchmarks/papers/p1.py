"""Zhu et al. 2019, container ship: the experiment behind table 2 and figures 8-12, the paper's three searches for C.

What the paper leaves out, and what is assumed: orders of the propeller that hold for 60 s; no noise, or white noise of
0.01 m/s and 0.01 deg/s; columns as they come (revolutions per minute); as many evaluations for the swarm as for the
bees; five-fold cross-validation over a logarithmic grid. Eq. 26 is no expansion of eq. 2, and is taken as printed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.papers.container import run
from benchmarks.papers.record import Record, steps, zigzag
from identify.estimators import ESTIMATORS, predict
from identify.estimators.estimate import FloatArray
from identify.estimators.tuning import cross_validate
from identify.optimisers import OPTIMISERS, minimise
from preprocess.eso import Observer, filter_like, observe

STEP = 0.5  # s
U0, N0 = 8.0, 80.0
RANGE = (1e-2, 1e10)
CHANNELS = ("surge", "sway", "yaw")
NAMES: Mapping[str, tuple[str, ...]] = {
    "surge": ("a1", "a2", "a3"),
    "sway": ("b_v", "b_r", "b_|v|r", "b_δ"),
    "yaw": ("c_v", "c_r", "c_|v|r", "c_δ"),
}
FILTER = Observer(0.2)  # rad/s


@dataclass(frozen=True)
class Rows:
    """A regression: design (l, d) and target (l,)."""

    design: FloatArray
    target: FloatArray

    def first(self, count: int) -> Rows:
        """The first samples."""
        return Rows(self.design[:count], self.target[:count])


def speeds(low: float, seed: int, duration: float) -> Record:
    """A straight run with revolutions drawn anew every minute, up to 160 per minute."""
    count = round(duration / 60.0) + 1
    turns = np.random.default_rng(seed).uniform(low, 160.0, count) / 60.0
    return run(steps(60.0 * np.arange(count), np.zeros(count), turns), duration)


def runs(duration: float = 900.0) -> tuple[dict[str, Record], dict[str, Record]]:
    """Training and validation by channel."""
    straight, other = speeds(120.0, 1, duration), speeds(100.0, 2, duration)
    ten, twenty = (run(zigzag(a, a, N0 / 60.0), duration) for a in (10.0, 20.0))
    return dict(zip(CHANNELS, (straight, ten, ten), strict=True)), dict(
        zip(CHANNELS, (other, twenty, twenty), strict=True)
    )


def noisy(record: Record, seed: int) -> Record:
    """White noise on what is measured."""
    return record.noisy((0.01, 0.01, float(np.radians(0.01))), seed)


def terms(record: Record, channel: str) -> FloatArray:
    """Eq. 27."""
    (u, v, r), n = record.states.T, 60.0 * record.inputs["n"]
    if channel == "surge":
        return np.column_stack([u - U0, (u - U0) ** 3, n - N0])
    return np.column_stack([v, r, np.abs(v) * r, record.inputs["rudder"]])


def differences(record: Record, channel: str) -> Rows:
    """Forward differences, as the paper."""
    state = record.states[:, CHANNELS.index(channel)]
    return Rows(terms(record, channel)[:-1], np.diff(state) / STEP)


def filtered(record: Record, channel: str) -> Rows:
    """Both sides through one observer."""
    state = record.states[:, CHANNELS.index(channel)]
    target = observe(FILTER, record.t, state)[:, 1]
    return Rows(filter_like(FILTER, record.t, terms(record, channel)), target)


def fitted(rows: Rows, c: float) -> FloatArray:
    """Coefficients of an LS-SVR with this C."""
    return ESTIMATORS["lssvm"].fit(rows.design, rows.target, C=c, scaled=False, covariance="none").theta


def training_error(rows: Rows) -> Callable[[FloatArray], FloatArray]:
    """Eq. 16 of a population of C (m, 1)."""

    def error(population: FloatArray) -> FloatArray:
        found = []
        for c in population[:, 0]:
            fit = ESTIMATORS["lssvm"].fit(
                rows.design, rows.target, C=float(c), scaled=False, covariance="none"
            )
            found.append(np.mean((rows.target - predict(fit, rows.design)) ** 2))
        return np.array(found)

    return error


def by_swarm(name: str, iterations: int = 30) -> Callable[[Rows, int], float]:
    """C by ABC or PSO on the training error: 20 sources or particles."""
    options = {"population": 20, "limit": 30, "selection": "fitness"} if name == "abc" else {"population": 20}

    def search(rows: Rows, seed: int) -> float:
        budget = 20 + iterations * 40
        return float(minimise(OPTIMISERS[name], training_error(rows), [RANGE], budget, seed, **options).x[0])

    return search


def by_folds(rows: Rows, seed: int) -> float:
    """C by five-fold cross-validation over half decades."""
    grid = np.logspace(-2, 10, 25)
    data = (rows.design, rows.target, None)
    error = [cross_validate(ESTIMATORS["lssvm"], data, C=float(c), scaled=False) for c in grid]
    return float(grid[int(np.argmin(error))])


def searches(*, quick: bool) -> Mapping[str, Callable[[Rows, int], float]]:
    """The paper's three."""
    count = 1 if quick else 30
    return {"CV": by_folds, "PSO": by_swarm("pso", count), "ABC": by_swarm("abc", count)}


def timed(search: Callable[[Rows, int], float], rows: Rows, seed: int) -> tuple[float, float]:
    """C, and seconds."""
    begin = time.perf_counter()
    return search(rows, seed), time.perf_counter() - begin
