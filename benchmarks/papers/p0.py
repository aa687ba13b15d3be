"""Xie et al. 2020 (ABEL): the experiment behind tables 3, 5 and 6, the paper's methods and ours.

What the paper leaves out, and what is assumed: 200 s at 0.1 s; the propeller at the revolutions that hold
1.179 m/s; rudder at 15.8 deg/s; C = 1e4 (of columns of unit size), C_b = 1; bandwidths between 0.5 and 6.5
rad/s (κ = 3 makes the range 6); the fitness searched is the free-running error on the training data;
the disturbance of eq. 35 is added to the measured states. Every method is scored by its free run against the
undisturbed truth of the same manoeuvre: u + v + L r, the tables' fitness (eq. 29 prints u + v + r).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.papers.abkowitz import SIZES, errors, regressors
from benchmarks.papers.kvlcc2 import SPEED, STEP, Run, zigzag
from identify.estimators import ESTIMATORS
from identify.estimators.estimate import FloatArray
from identify.optimisers import OPTIMISERS, minimise
from preprocess.eso import Observer, filter_like, observe

LENGTH = 7.0
C = 1e4
BUDGET = 4 + 2 + 4 * 20 * 3  # table 2: 4 beetles, 20 iterations, three evaluations each, and the start
BANDWIDTHS = (0.5, 6.5)
QUICK: Mapping[str, Any] = {"C": C, "covariance": "none"}


@dataclass(frozen=True)
class Case:
    """What is measured, and the truth that a fit is scored on."""

    t: FloatArray
    states: FloatArray
    delta: FloatArray
    truth: Run


def clean(angle_deg: float) -> Case:
    """Undisturbed zigzag."""
    run = zigzag(angle_deg)
    return Case(run.t, run.states, run.delta, run)


def disturbed(case: Case, level: float, seed: int) -> Case:
    """Eq. 35: F (sin(0.3 π i) + 2 r - 1) with F = level · |x| and r uniform, on each state."""
    index = np.arange(len(case.t))[:, None]
    random = np.random.default_rng(seed).random(case.states.shape)
    noise = level * np.abs(case.states) * (np.sin(0.3 * np.pi * index) + 2 * random - 1)
    return replace(case, states=case.states + noise)


def thinned(case: Case, share: float, seed: int) -> Case:
    """Lose samples at random, never the first or the last."""
    kept = np.random.default_rng(seed).random(len(case.t)) >= share
    kept[[0, -1]] = True
    return Case(case.t[kept], case.states[kept], case.delta[kept], case.truth)


def score(theta: FloatArray, case: Case, *, fixed: bool = False) -> FloatArray:
    """Free-running errors of u, v, r against the truth, and their fitness, (4,)."""
    truth = case.truth
    found = errors(theta, truth.t, truth.states, truth.delta, SPEED, fixed=fixed)[0]
    return np.nan_to_num(np.append(found, fitness(found)), nan=np.inf, posinf=np.inf)


def fitness(found: FloatArray) -> FloatArray:
    """Sum up as u + v + L r; infinite where a run diverged."""
    total = np.nan_to_num(found @ [1.0, 1.0, LENGTH], nan=np.inf, posinf=np.inf)
    return np.asarray(total)


def fit(
    designs: tuple[FloatArray, ...], targets: FloatArray, name: str, options: Mapping[str, Any]
) -> FloatArray:
    """Fit the three equations, each followed by its bias, (46,)."""
    parts = []
    for design, target in zip(designs, targets.T, strict=True):
        found = ESTIMATORS[name].fit(design, target, **options)
        parts.append(np.append(found.theta, found.bias))
    return np.concatenate(parts)


def without_bias(theta: FloatArray) -> FloatArray:
    """Eq. 14: what is left of a fit when its bias is thrown away.

    With U fixed the column U² is the bias over again: that of table 4 is zero (9.8e-15).
    """
    kept = theta.copy()
    ends = np.cumsum([size + 1 for size in SIZES]) - 1
    kept[[*ends, ends[0] + 2, ends[1] + 2]] = 0.0
    return kept


def differences(
    case: Case, *, nominal: bool, fixed: bool = False
) -> tuple[tuple[FloatArray, ...], FloatArray]:
    """Eq. 22: forward differences, by the true time between samples or by the nominal one."""
    step = STEP if nominal else np.diff(case.t)[:, None]
    designs = regressors(case.states[:-1], case.delta[:-1], SPEED, fixed=fixed)
    return designs, np.diff(case.states, axis=0) / step


def lssvm_printed(case: Case, seed: int) -> FloatArray:
    """LSSVM as the paper uses it: U fixed, nominal steps, and the bias dropped."""
    return without_bias(fit(*differences(case, nominal=True, fixed=True), "lssvm", QUICK))


def lssvm(case: Case, seed: int) -> FloatArray:
    """Fit the same LSSVM with U(t), the true time stamps, and its bias."""
    return fit(*differences(case, nominal=False), "lssvm", QUICK)


def observed(case: Case, bandwidths: FloatArray) -> FloatArray:
    """Fit on the accelerations that three observers see, regressors as measured (eq. 19-28)."""
    targets = [
        observe(Observer(float(w)), case.t, x)[:, 1] for w, x in zip(bandwidths, case.states.T, strict=True)
    ]
    designs = regressors(case.states, case.delta, SPEED)
    return fit(designs, np.column_stack(targets), "eso_lssvm", {**QUICK, "C_b": 1.0})


def searched(optimiser: str) -> Callable[[Case, int], FloatArray]:
    """ESO-LSSVM with the bandwidths found by an optimiser on the free-running error (3.2)."""

    def method(case: Case, seed: int) -> FloatArray:
        def objective(population: FloatArray) -> FloatArray:
            thetas = np.array([observed(case, w) for w in population])
            return fitness(errors(thetas, case.t, case.states, case.delta, SPEED))

        options = {"population": 4, "attenuation": 0.9}
        found = minimise(OPTIMISERS[optimiser], objective, [BANDWIDTHS] * 3, BUDGET, seed, **options)
        if not np.isfinite(found.value):  # every candidate's free run diverged
            return np.full(sum(SIZES) + len(SIZES), np.nan)
        return observed(case, found.x)

    return method


def filtered(case: Case, seed: int) -> FloatArray:
    """See accelerations and regressors through one observer of 1 rad/s, nothing searched: both lag alike."""
    observer = Observer(1.0)
    targets = observe(observer, case.t, case.states)[:, 1, :]
    designs = tuple(filter_like(observer, case.t, d) for d in regressors(case.states, case.delta, SPEED))
    return fit(designs, targets, "eso_lssvm", {**QUICK, "C_b": 0.0})


METHODS: Mapping[str, Callable[[Case, int], FloatArray]] = {
    "LSSVM as printed": lssvm_printed,
    "LSSVM, b and stamps kept": lssvm,
    "BEL (bsas)": searched("bsas"),
    "ABEL (absas)": searched("absas"),
    "one filter on both sides": filtered,
}

Printed = Mapping[str, tuple[float, float, float]]


def show(title: str, make: Callable[[int], Case], printed: Printed, seeds: int) -> None:
    """Print one column of a table: medians over the seeds, and the spread of the fitness."""
    print(f"\n{title}\n{'':28}{'MSE u':>10}{'MSE v':>10}{'MSE r':>10}{'fitness':>10}{'spread':>20}")
    for name, values in printed.items():
        total = values[0] + values[1] + LENGTH * values[2]
        print(f"{'paper: ' + name:28}{''.join(f'{x:>10.2e}' for x in (*values, total))}")
    abel = float(fitness(np.array(printed["ABEL"])))
    for name, method in METHODS.items():
        fixed = method is lssvm_printed
        cases = [make(s) for s in range(seeds)]
        found = np.array([score(method(c, s), c, fixed=fixed) for s, c in enumerate(cases)])
        middle = np.median(found, axis=0)
        spread = f"{found[:, 3].min():.1e}..{found[:, 3].max():.1e}"
        ratio = f"  ABEL's / {abel / middle[3]:.0f}" if middle[3] < abel else ""
        print(f"{name:28}{''.join(f'{x:>10.2e}' for x in middle)}{spread:>20}{ratio}", flush=True)


def seeds_from_command_line(description: str | None) -> int:
    """How many seeds."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--seeds", type=int, default=5)
    return int(parser.parse_args().seeds)
