"""Optimisers on standard functions, with library implementations beside them.

    python -m benchmarks.bench_optimisers [--seeds 5] [--dimension 10] [--budget 20000]

Prints the median of the best values, and the seconds per run. scipy and cma come with the program; niapy and
pyswarms are compared where they are installed.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
import warnings
from collections.abc import Callable

import numpy as np

from identify.optimisers import OPTIMISERS, minimise
from identify.optimisers.state import FloatArray

Objective = Callable[[FloatArray], FloatArray]
Run = Callable[[Objective, FloatArray, int, int], float]
CENTRE = 0.3  # of the symmetric functions, so that no method gains by trying the middle of the box


def sphere(x: FloatArray) -> FloatArray:
    return np.sum((x - CENTRE) ** 2, axis=1)


def rosenbrock(x: FloatArray) -> FloatArray:
    return np.sum(100 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2, axis=1)


def rastrigin(x: FloatArray) -> FloatArray:
    z = x - CENTRE
    return np.sum(10 + z**2 - 10 * np.cos(2 * np.pi * z), axis=1)


def ackley(x: FloatArray) -> FloatArray:
    z = x - CENTRE
    cosine = np.mean(np.cos(2 * np.pi * z), axis=1)
    return 20 + np.e - 20 * np.exp(-0.2 * np.sqrt(np.mean(z**2, axis=1))) - np.exp(cosine)


FUNCTIONS: dict[str, Objective] = {
    "sphere": sphere,
    "Rosenbrock": rosenbrock,
    "Rastrigin": rastrigin,
    "Ackley": ackley,
}


class Counted:
    """An objective of one point that remembers its best, and gives nothing away beyond the budget."""

    def __init__(self, objective: Objective, budget: int) -> None:
        self.objective, self.left, self.best = objective, budget, np.inf

    def __call__(self, x: FloatArray) -> float:
        """Evaluate one point."""
        value = float(self.objective(np.atleast_2d(x))[0])
        if self.left > 0:
            self.best = min(self.best, value)
        self.left -= 1
        return value


def ours(name: str) -> Run:
    def run(objective: Objective, box: FloatArray, budget: int, seed: int) -> float:
        return minimise(OPTIMISERS[name], objective, box, budget, seed).value

    return run


def scipy_de(objective: Objective, box: FloatArray, budget: int, seed: int) -> float:
    from scipy.optimize import differential_evolution

    counted = Counted(objective, budget)
    generations = max(budget // (15 * len(box)) - 1, 1)
    differential_evolution(counted, box, maxiter=generations, seed=seed, polish=False, tol=0, init="random",
                           strategy="rand1bin")  # fmt: skip
    return counted.best


def scipy_annealing(objective: Objective, box: FloatArray, budget: int, seed: int) -> float:
    from scipy.optimize import dual_annealing

    counted = Counted(objective, budget)
    dual_annealing(counted, box, maxfun=budget, seed=seed)
    return counted.best


def scipy_lbfgs(objective: Objective, box: FloatArray, budget: int, seed: int) -> float:
    from scipy.optimize import minimize

    counted, random = Counted(objective, budget), np.random.default_rng(seed)
    while counted.left > 0:
        minimize(counted, random.uniform(*box.T), method="L-BFGS-B", bounds=box)
    return counted.best


def cma_fmin(objective: Objective, box: FloatArray, budget: int, seed: int) -> float:
    import cma

    counted = Counted(objective, budget)
    options = {"bounds": list(box.T), "seed": seed + 1, "maxfevals": budget, "verbose": -9}
    cma.fmin2(counted, box.mean(axis=1), 0.3 * float(np.ptp(box[0])), options)
    return counted.best


def niapy(algorithm: str, **options: float) -> Run:
    def run(objective: Objective, box: FloatArray, budget: int, seed: int) -> float:
        from niapy.algorithms import basic
        from niapy.problems import Problem
        from niapy.task import Task

        counted = Counted(objective, budget)

        class _Problem(Problem):
            def _evaluate(self, x: FloatArray) -> float:
                return counted(x)

        task = Task(_Problem(len(box), *box.T), max_evals=budget)
        getattr(basic, algorithm)(seed=seed, **options).run(task)
        return counted.best

    return run


def pyswarms(objective: Objective, box: FloatArray, budget: int, seed: int) -> float:
    from pyswarms.single import GlobalBestPSO

    np.random.seed(seed)  # noqa: NPY002 (the library knows no other)
    options = {"c1": 1.49618, "c2": 1.49618, "w": 0.7298}
    swarm = GlobalBestPSO(20, len(box), options, bounds=tuple(box.T))
    return float(swarm.optimize(objective, budget // 20, verbose=False)[0])


def libraries() -> dict[str, Run]:
    """Find what there is to compare with."""
    found: dict[str, Run] = {
        "scipy DE rand1bin": scipy_de,
        "scipy annealing": scipy_annealing,
        "scipy L-BFGS-B": scipy_lbfgs,
        "cma fmin2": cma_fmin,
    }
    if importlib.util.find_spec("niapy"):
        found["niapy ABC"] = niapy("ArtificialBeeColonyAlgorithm", population_size=40)
        found["niapy DE"] = niapy("DifferentialEvolution", population_size=20, crossover_probability=0.9)
    if importlib.util.find_spec("pyswarms"):
        found["pyswarms PSO"] = pyswarms
    return found


def line(name: str, run: Run, box: FloatArray, budget: int, seeds: int) -> str:
    cells, begin = [], time.perf_counter()
    for objective in FUNCTIONS.values():
        cells.append(f"{np.median([run(objective, box, budget, s) for s in range(seeds)]):>12.1e}")
    taken = (time.perf_counter() - begin) / (seeds * len(FUNCTIONS))
    return f"{name:<18}{''.join(cells)}{taken:>9.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--dimension", type=int, default=10)
    parser.add_argument("--budget", type=int, default=20_000)
    chosen = parser.parse_args()
    box = np.tile([-5.0, 5.0], (chosen.dimension, 1))
    print(f"{chosen.dimension} variables in ±5, {chosen.budget} evaluations, median of {chosen.seeds} seeds")
    print(f"{'':<18}{''.join(f'{n:>12}' for n in FUNCTIONS)}{'s/run':>9}")
    for name in OPTIMISERS:
        print(line(name, ours(name), box, chosen.budget, chosen.seeds), flush=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, run in libraries().items():
            print(line(name, run, box, chosen.budget, chosen.seeds), flush=True)


if __name__ == "__main__":
    main()
