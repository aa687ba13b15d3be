"""LSSVM with a linear kernel: the primal against the dual, and its growth with the samples.

    python -m benchmarks.bench_lssvm [--largest-dual 8000]

The dual is the papers' dense system (Xie et al. 2020, eq. 11). "primal" solves for the same parameters;
"with cov." is the whole fit with its correlation-robust covariance and its verdicts, as a user gets it.
Medians.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np

from identify.estimators.estimate import Estimate, FloatArray
from identify.estimators.lssvm import Machine, fit_lssvm, solve_dual, solve_machine
from identify.estimators.problem import problem

COLUMNS = 16
C = 1e4


def data(rows: int, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Regressors of yaw as a 20/20 zigzag gives them: smooth, correlated, of very different size."""
    rng = np.random.default_rng(seed)
    t = np.arange(rows) * 0.1
    v, r = 0.1 * np.sin(0.05 * t) + 0.01 * np.sin(0.31 * t), 0.02 * np.cos(0.05 * t) + 0.002 * np.sin(0.2 * t)
    delta, u = 0.35 * np.sign(np.sin(0.05 * t + 0.7)), 0.1 * np.cos(0.1 * t)
    speed = 1.179 + u
    columns = [r, speed**2, u * speed, u**2, v * speed, r * speed, delta * speed**2, v**3 / speed]
    columns += [delta**3 * speed**2, v**2 * r / speed, v**2 * delta, v * delta**2 * speed]
    columns += [delta * u * speed, v * u, r * u, delta * u**2]
    design = np.column_stack(columns)
    design += 1e-3 * design.std(axis=0) * rng.standard_normal(design.shape)
    return design, design @ rng.standard_normal(COLUMNS) + 1e-3 * rng.standard_normal(rows)


def seconds(function: Callable[[], object], least: float = 0.3) -> float:
    """Median time of a call."""
    function()
    times: list[float] = []
    while sum(times) < least or len(times) < 5:
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def primal(design: FloatArray, target: FloatArray) -> FloatArray:
    """Parameters and bias, in scaled columns."""
    return solve_machine(problem(design, target, bias=True), Machine(C))[0].beta


def dual(design: FloatArray, target: FloatArray) -> FloatArray:
    """Solve for the same by the dense system."""
    trained = solve_dual(problem(design, target, bias=True), Machine(C))
    return np.append(trained.support.T @ trained.alpha, trained.bias)


def row(rows: int, largest_dual: int) -> str:
    design, target = data(rows)
    quick = seconds(lambda: primal(design, target))
    whole = seconds(lambda: fit_lssvm(design, target, C=C))
    text = f"{rows:>8}  {quick * 1e3:>10.3f}  {whole * 1e3:>15.2f}"
    if rows > largest_dual:
        return text + f"  {'-':>9}  {'-':>7}  {'-':>10}  {8e-6 * rows**2:>9.0f}"
    begin = time.perf_counter()
    slow = dual(design, target)
    taken = time.perf_counter() - begin
    fast = primal(design, target)
    difference = float(np.max(np.abs(fast - slow)) / np.max(np.abs(slow)))
    return text + f"  {taken:>9.3f}  {taken / quick:>7.0f}  {difference:>10.1e}  {8e-6 * rows**2:>9.0f}"


def verdicts(fit: Estimate) -> str:
    good = int(fit.identifiable.sum())
    return f"identifiable: {good} of {len(fit.theta)}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--largest-dual", type=int, default=8000)
    largest = parser.parse_args().largest_dual
    print(f"{COLUMNS} regressors and a bias, C = {C:.0e}")
    print(f"{'samples':>8}  {'primal ms':>10}  {'with cov. ms':>15}  {'dual s':>9}  {'ratio':>7}  "
          f"{'difference':>10}  {'matrix MB':>9}")  # fmt: skip
    for rows in (500, 1000, 2000, 4000, 8000, 20_000, 100_000):
        print(row(rows, largest), flush=True)
    print(verdicts(fit_lssvm(*data(8000), C=C)))


if __name__ == "__main__":
    main()
