"""Zhu et al. 2022: the experiment behind tables 4, 5 and 6, the paper's methods and ours.

What the paper leaves out, and what is assumed: orders of heading of 10 degrees, three sines at once (a single one, as
the paper's, excites two of the four coefficients; only its start tells the others), from rest; the compass with white
noise of 0.1 degrees or none, the rudder's angle exact; the first 60 % to identify on, as printed. The regularisation C
is found by ABC on the training error, which only falls as C grows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from benchmarks.papers.nomoto import STEP, Ship, Voyage, constants_of, low_passed, observer_as_printed
from identify.base_fit import fit_states
from identify.estimators import ESTIMATORS
from identify.estimators.estimate import FloatArray
from identify.first_states import first_states, state_precision
from identify.noise import calibrated
from identify.optimisers import OPTIMISERS, minimise
from identify.output_error import prior_for, solve
from identify.prepare import prepare
from identify.reduction import reduce
from identify.regression import coefficient_scales
from identify.structure import Structure, null_parameters
from identify.windows import cut, moments
from preprocess.trial import Measurement, Trial
from preprocess.vessel import Input, Vessel

NOISE = np.radians(0.1)
TRAINING = 0.6
BANDWIDTH = 45.0  # rad/s, of the paper's observer
STARTS = (0.1, 0.3, 1.0, 3.0, 10.0)  # rad/s
MOST_ROWS = 20_000  # of a regression; the observers see every sample
RUDDER = Input("rudder", "rudder", position=(-0.5, 0.0))
ORDER = ("T1", "T2", "T3", "K")


def measured(run: Voyage, noise: float, seed: int) -> Voyage:
    """The run with a noisy compass."""
    random = np.random.default_rng(seed)
    return replace(run, psi=run.psi + noise * random.standard_normal(len(run.t)))


def best_c(design: FloatArray, target: FloatArray, seed: int, iterations: int) -> float:
    """C by ABC as printed in table 3 (30 sources, 30 iterations); the training error in the columns' own axes."""
    x = design / np.sqrt(np.mean(design**2, axis=0))
    x, y = x - x.mean(axis=0), target - target.mean()
    size, axes = np.linalg.eigh(x.T @ x)
    along = axes.T @ (x.T @ y)

    def error(population: FloatArray) -> FloatArray:
        w = along / (size + 1.0 / population)
        return np.asarray((y @ y - 2.0 * w @ along + w**2 @ size) / len(y))

    options = {"population": 30, "limit": 35, "selection": "fitness"}
    return float(
        minimise(OPTIMISERS["abc"], error, [[1e-2, 1e10]], 30 + iterations * 60, seed, **options).x[0]
    )


def _regressed(name: str, design: FloatArray, target: FloatArray, seed: int, iterations: int) -> FloatArray:
    every = max(1, len(target) // MOST_ROWS)
    x, y = design[::every], target[::every]
    return ESTIMATORS[name].fit(x, y, C=best_c(x, y, seed, iterations), covariance="none").theta


def seen_as_printed(ship: Ship, seen: Voyage) -> tuple[FloatArray, FloatArray]:
    """Design and target of eq. 29 by the observer of eq. 8."""
    z = observer_as_printed(ship, seen.t, seen.psi, seen.order)
    delta_rate = (ship.helm * (seen.order - z[:, 0]) - z[:, 2]) / ship.gear
    return np.column_stack([z[:, 3], z[:, 1], delta_rate, z[:, 2]]), z[:, 4] + seen.order


def seen_alike(seen: Voyage, bandwidth: float = BANDWIDTH) -> tuple[FloatArray, FloatArray]:
    """Design and target of eq. 29 with heading and rudder through one filter."""
    psi, delta = (low_passed(x, bandwidth, STEP) for x in (seen.psi, seen.delta))
    return np.column_stack([psi[:, 2], psi[:, 1], delta[:, 1], delta[:, 0]]), psi[:, 3]


Method = Callable[[Ship, Voyage, int], FloatArray]


def printed(name: str, iterations: int) -> Method:
    """Observer and regression as printed."""
    return lambda ship, seen, seed: _regressed(name, *seen_as_printed(ship, seen), seed, iterations)


def alike(name: str, iterations: int) -> Method:
    """The paper's regression, both sides through one filter."""
    return lambda ship, seen, seed: _regressed(name, *seen_alike(seen), seed, iterations)


def trial_of(ship: Ship, seen: Voyage, noise: float) -> Trial:
    """Heading and rudder as the library takes them; the smoothed states are those of the filter, for the start."""
    t, good = seen.t, np.ones(len(seen.t), dtype=bool)
    heading = Measurement("heading", t, seen.psi, max(noise, 1e-6), good, sample_time=STEP)
    rudder = Measurement("rudder", t, seen.delta, 0.0, good)  # exact, so that its clock is not in question
    rate = low_passed(seen.psi, 4.0 / ship.T2, STEP)[:, 1]
    still = dict.fromkeys(("x", "y", "u", "v", "sigma_u", "sigma_v", "sigma_r"), 0.0 * t)
    states = pd.DataFrame({"t": t, **still, "psi": seen.psi, "r": rate})
    vessel = Vessel(ship.name, length=ship.length, beam=0.2 * ship.length)
    return Trial(
        ship.name, "identify", vessel, (RUDDER,), {"heading": heading}, {"rudder": rudder}, states,
        ((float(t[0]), float(t[-1])),),
    )  # fmt: skip


def _theta(p: FloatArray) -> FloatArray:
    """Coefficients of eq. 29 from those of the library's `nomoto2`: of r, δ in ṙ and of r, δ in the extra state."""
    return np.array([p[0], p[2], p[1], p[3]])


def _slots(theta: FloatArray) -> FloatArray:
    return np.array([theta[0], theta[2], theta[1], theta[3]])


def output_error(ship: Ship, seen: Voyage, seed: int) -> FloatArray:
    """Ours: the whole run in one window, from the best of what slow filters and regression give."""
    prepared = prepare([trial_of(ship, seen, NOISE)], "nomoto2")
    structure, problem = prepared.structure, cut(prepared.identify, float(seen.t[-1]))
    prior = prior_for(structure, coefficient_scales(structure, null_parameters(structure), prepared.identify))
    prior = replace(prior, sd=1e3 * prior.sd)
    begun = [fit_states(problem, structure, p) for p in _starts(structure, seen)]
    best = min(begun, key=lambda s: s.cost if np.isfinite(s.cost) else np.inf)
    for _ in range(2):
        best = solve(problem, structure, best.p, best.first, prior, budget=60, tolerance=1e-3)
        problem = calibrated(problem, best)
    return _theta(best.p)


def _starts(structure: Structure, seen: Voyage) -> list[FloatArray]:
    """Parameters by regression through filters from slow to quick."""
    found = []
    for bandwidth in STARTS:
        theta = ESTIMATORS["ls"].fit(*seen_alike(seen, bandwidth), covariance="none").theta
        found.append(np.append(_slots(theta), np.zeros(len(structure.slots) - 4)))
    return found


def bound(ship: Ship, seen: Voyage, noise: float = NOISE) -> FloatArray:
    """Cramér-Rao standard deviations of T1, T2, T3, K at the truth, the first state unknown."""
    prepared = prepare([trial_of(ship, seen, noise)], "nomoto2")
    structure, p = prepared.structure, _slots(ship.theta)
    p = np.append(p, np.zeros(len(structure.slots) - 4))
    problem = cut(prepared.identify, float(seen.t[-1]))
    first = first_states(problem)
    first[0, :7] = [
        0,
        0,
        seen.psi[0],
        0,
        0,
        seen.rate[0],
        seen.acceleration[0] - ship.theta[2] * seen.delta[0],
    ]
    now = moments(problem, structure, p, first)
    information = reduce(now.matrices, first, first, state_precision(structure)).information.sum(axis=0)[
        :4, :4
    ]
    slope = _slope(p[:4])
    return np.asarray(np.sqrt(np.diag(slope @ np.linalg.inv(information) @ slope.T)))


def _slope(p: FloatArray) -> FloatArray:
    """Derivative of T1, T2, T3, K with respect to the library's coefficients."""
    columns = []
    for k in range(4):
        step = np.zeros(4)
        step[k] = 1e-6 * p[k]
        both = [constants_of(_theta(p + sign * step)) for sign in (1, -1)]
        columns.append((both[0] - both[1]) / (2 * step[k]))
    return np.column_stack(columns)


def methods(iterations: int = 30) -> Mapping[str, Method]:
    """The paper's two, its regression with one filter on both sides, and ours; the iterations are ABC's."""
    return {
        "ESO as printed, LS-SVR": printed("lssvm", iterations),
        "ESO as printed, RW-LSSVR": printed("rw_lssvr", iterations),
        "one filter, RW-LSSVR": alike("rw_lssvr", iterations),
        "output error": output_error,
    }
