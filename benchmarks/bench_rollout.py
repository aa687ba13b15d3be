"""The compiled rollout: alone, over a population, with sensitivities, and beside scipy's solve_ivp.

Wall-clock seconds, the best of several repeats; on a machine that does other things too, look at the processor seconds.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from identify import kernel
from identify.lanes import population_in_lanes, tape_of
from identify.models import MODEL_BY_NAME, terms_for
from identify.structure import Structure, structure_for
from preprocess.vessel import Input, Vessel

STEPS, STEP = 5000, 0.1
CANDIDATES = 64
DIRECTIONS = 30
VESSEL = Vessel("bench", 1.255, 0.29)
INPUTS = (Input("rudder", "rudder", position=(-0.5, 0.0)), Input("n", "propeller", position=(-0.5, 0.0)))

#: CyberShip II per unit inertia (Skjetne et al. 2004, made stable), the 27 terms of ``cybership2``.
HULL = {
    "u": {"u": -0.028, "|u|u": -0.051, "u³": -0.227, "vr": 1.31, "r²": 0.04, "|n|n": 3.1e-4, "|n|u": -1.5e-3},
    "v": {"ur": -0.6, "uv": -0.27, "v": -0.07, "|v|v": -1.1, "|r|v": -0.02, "r": -0.08, "|v|r": -0.02, "|r|r": -0.1,
          "|u|uδ": 0.2, "|u|u|δ|δ": -0.09},
    "r": {"ur": 0.05, "uv": 1.2, "v": 0.01, "|v|v": 1.4, "|r|v": 0.05, "r": -0.7, "|v|r": 0.03, "|r|r": -0.3,
          "|u|uδ": -1.28, "|u|u|δ|δ": 0.58},
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """Everything that one rollout takes."""

    structure: Structure
    channels: np.ndarray
    slopes: np.ndarray
    wind: np.ndarray
    coefficients: np.ndarray
    first: np.ndarray


def case() -> Case:
    """A zigzag of 500 s with the 27 terms of ``cybership2``."""
    structure, _ = structure_for("cybership2", VESSEL, INPUTS, logs=("a",), streams=("position", "heading"))
    t = STEP * (np.arange(STEPS) + 0.5)
    rudder = np.where(np.sin(2 * np.pi * t / 30.0) >= 0, 0.35, -0.35)
    names = structure.table.channels
    values = {"−": -1.0, "δ": rudder, "|δ|": np.abs(rudder), "|n|n": 14.0**2, "|n|": 14.0}
    channels = np.column_stack([np.broadcast_to(values.get(n, 0.0), STEPS) for n in names]).astype(float)
    coefficients = np.array(
        [HULL[t.dof][t.text] for t in terms_for(MODEL_BY_NAME["cybership2"], VESSEL, INPUTS)[0]]
    )
    first = np.array([0, 0, 0, 0.5, 0, 0, 0, 0], dtype=float)
    return Case(structure, channels, np.zeros_like(channels), np.zeros((STEPS, 2)), coefficients, first)


def best(function: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Least wall-clock and processor seconds of a call."""
    function()
    wall, processor = [], []
    for _ in range(repeats):
        a, b = time.perf_counter(), time.process_time()
        function()
        wall.append(time.perf_counter() - a)
        processor.append(time.process_time() - b)
    return min(wall), min(processor)


def one_rollout(c: Case) -> np.ndarray:
    """States (n + 1, 8) of one free run."""
    t = c.structure.table
    states, rates = np.empty((STEPS + 1, 8)), np.empty((STEPS + 1, 8))
    kernel.rollout(c.first, STEP, False, c.channels, c.slopes, c.wind, np.zeros(2), 0.5, t.equation, t.which, t.product,
                   c.coefficients, states, rates)  # fmt: skip
    return states


def population(c: Case, workers: int) -> np.ndarray:
    """States (64, n + 1, 8) of a population, shared by threads."""
    t = c.structure.table
    spread = 1.0 + 0.01 * np.random.default_rng(0).standard_normal((CANDIDATES, len(c.coefficients)))
    candidates = c.coefficients * spread
    states = np.empty((CANDIDATES, STEPS + 1, 8))

    def part(rows: np.ndarray) -> None:
        kernel.population(c.first, STEP, False, c.channels, c.slopes, c.wind, np.zeros(2), 0.5, t.equation, t.which,
                          t.product, candidates[rows], states[rows[0] : rows[-1] + 1])  # fmt: skip

    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(part, np.array_split(np.arange(CANDIDATES), workers)))
    return states


def in_lanes(c: Case, workers: int) -> np.ndarray:
    """The same population, eight abreast."""
    tape = tape_of(c.structure.table)
    spread = 1.0 + 0.01 * np.random.default_rng(0).standard_normal((CANDIDATES, len(c.coefficients)))
    parts = np.array_split(c.coefficients * spread, workers)
    with ThreadPoolExecutor(workers) as pool:
        done = pool.map(
            lambda p: population_in_lanes(
                tape, c.first, STEP, c.channels, c.slopes, c.wind, np.zeros(2), 0.5, p
            ),
            parts,
        )
        return np.concatenate(list(done))


def with_sensitivities(c: Case) -> np.ndarray:
    """Sensitivities (n + 1, 8, 8 + 22) of one free run: the initial state and 22 coefficients, 30 in all."""
    t, n = c.structure.table, DIRECTIONS - kernel.NX
    nc = c.channels.shape[1]
    simple = np.arange(n)
    states, rates = np.empty((STEPS + 1, 8)), np.empty((STEPS + 1, 8))
    s, f = np.empty((STEPS + 1, 8, DIRECTIONS)), np.empty((STEPS + 1, 8, DIRECTIONS))
    kernel.sensitivities(
        c.first, STEP, False, c.channels, c.slopes, c.wind, np.zeros(2), 0.5, t.equation, t.which, t.product,
        c.coefficients, simple, t.equation_of, np.zeros((0, len(c.coefficients))), np.zeros((STEPS, nc + 2, 0)),
        np.zeros((STEPS, nc, 0)), np.zeros((2, 0)), states, rates, s, f, np.empty((STEPS, 3, nc)),
    )  # fmt: skip
    return s


def by_scipy(c: Case, rtol: float) -> np.ndarray:
    """States (n + 1, 8) by solve_ivp RK45 with the same right-hand side, compiled too."""
    t = c.structure.table
    q, f, still = np.empty(14 + c.channels.shape[1]), np.empty(8), np.zeros(2)
    flat = np.zeros(c.channels.shape[1])

    def rhs(time_: float, z: np.ndarray) -> np.ndarray:
        k = min(int(time_ / STEP), STEPS - 1)
        kernel.factors(z, c.channels[k], flat, 0.0, c.wind[k], still, 0.5, q)
        kernel.derivative(z, still, t.equation, t.which, t.product, c.coefficients, q, f)
        return f.copy()

    end = STEPS * STEP
    return np.asarray(
        solve_ivp(
            rhs, (0, end), c.first, t_eval=STEP * np.arange(STEPS + 1), rtol=rtol, atol=1e-9, max_step=1.0
        ).y.T
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    chosen = parser.parse_args()
    c = case()
    one = best(lambda: one_rollout(c), chosen.repeats)
    many = best(lambda: population(c, chosen.workers), max(3, chosen.repeats // 4))
    abreast = best(lambda: in_lanes(c, chosen.workers), max(3, chosen.repeats // 4))
    sensitive = best(lambda: with_sensitivities(c), max(3, chosen.repeats // 4))
    slow = best(lambda: by_scipy(c, 1e-6), 2)
    difference = np.abs(one_rollout(c)[:, 3:6] - by_scipy(c, 1e-9)[:, 3:6]).max()
    rows = (
        ("one rollout, ms", one, 1e3, "≤ 0.5"),
        (f"per candidate of {CANDIDATES}, {chosen.workers} threads, ms", many, 1e3 / CANDIDATES, "≤ 0.15"),
        ("the same in lanes, ms", abreast, 1e3 / CANDIDATES, "≤ 0.15"),
        (f"sensitivities of {DIRECTIONS}, ms", sensitive, 1e3, ""),
        ("scipy solve_ivp, ms", slow, 1e3, ""),
    )
    print(f"{STEPS} steps, {len(c.coefficients)} terms")
    print(f"{'':44}{'wall':>10}{'processor':>12}   aim")
    for name, (wall, processor), factor, aim in rows:
        print(f"{name:44}{wall * factor:10.3f}{processor * factor:12.3f}   {aim}")
    for k, label in ((0, "wall"), (1, "processor")):
        print(f"{label}: solve_ivp / rollout {slow[k] / one[k]:.0f} (aim ≥ 400), "
              f"sensitivities / rollout {sensitive[k] / one[k]:.1f} (aim ≤ 25)")  # fmt: skip
    print(f"largest difference of u, v, r from solve_ivp at 1e-9: {difference:.1e}")


if __name__ == "__main__":
    main()
