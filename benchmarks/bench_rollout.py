"""The compiled rollout: alone, over a population, with sensitivities, and beside scipy's solve_ivp.

Wall-clock seconds, the best of several repeats; on a machine that does other things too, look at the processor seconds.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from identify import kernel
from identify.lanes import Driven, population_in_lanes
from identify.models import MODEL_BY_NAME, terms_for
from identify.structure import Structure, structure_for
from identify.tangents import Along, Run, padded, run_for, sensitivities
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
    return kernel.free_run(
        c.structure.table.tape,
        c.first,
        STEP,
        False,
        c.channels,
        c.slopes,
        c.wind,
        np.zeros(2),
        0.5,
        c.coefficients,
    )


def candidates(c: Case) -> np.ndarray:
    """Coefficients (64, p) of a population."""
    spread = 1.0 + 0.01 * np.random.default_rng(0).standard_normal((CANDIDATES, len(c.coefficients)))
    return np.asarray(c.coefficients * spread)


def population(c: Case, workers: int) -> np.ndarray:
    """States (64, n + 1, 8) of a population, eight abreast, shared by threads."""
    driven = Driven(c.first, STEP, False, c.channels, c.slopes, c.wind, np.zeros(2), 0.5)
    return population_in_lanes(c.structure.table.tape, driven, candidates(c), workers)


@dataclass(frozen=True)
class Sensitive:
    """What a run with the sensitivities of 30 directions takes: the first state's 8 and 22 coefficients."""

    case: Case
    along: Along
    run: Run
    rows: np.ndarray

    def __call__(self) -> np.ndarray:
        """Sensitivities (n + 1, 8, 32)."""
        c = self.case
        sensitivities(c.first, 0, STEPS, STEP, False, c.channels, c.slopes, c.wind, np.zeros(2), 0.5,
                      c.structure.table.tape.steps, self.rows, self.along, self.run)  # fmt: skip
        return self.run.s


def sensitive(c: Case) -> Sensitive:
    """Places and directions for ``Sensitive``, made once."""
    table, n, width = c.structure.table, DIRECTIONS - kernel.NX, padded(DIRECTIONS)
    none, nothing = np.zeros(0, dtype=np.int64), np.zeros((STEPS, 0))
    along = Along(
        kernel.NX + np.arange(n), table.tape.value[:n].astype(np.int64), table.equation_of[:n], np.ones(n), none, none,
        none, np.zeros(0), none, none, none, nothing, nothing, np.zeros((2, width)),
    )  # fmt: skip
    run = run_for(table.tape, STEPS, width, c.channels.shape[1])
    return Sensitive(c, along, run, table.tape.rows(c.coefficients))


def by_scipy(c: Case, rtol: float) -> np.ndarray:
    """States (n + 1, 8) by solve_ivp RK45 with the same accelerations, compiled too."""
    tape, still = c.structure.table.tape, np.zeros(2)
    rows, scratch, flat = tape.rows(c.coefficients), kernel.scratch_for(tape, 1), np.zeros_like(c.channels)

    def rhs(time_: float, z: np.ndarray) -> np.ndarray:
        f = np.empty(8)
        kernel.derivative(
            z,
            min(int(time_ / STEP), STEPS - 1),
            0.0,
            c.channels,
            flat,
            still,
            still,
            0.5,
            tape.steps,
            rows,
            scratch,
            f,
        )
        return f

    end = STEPS * STEP
    return np.asarray(
        solve_ivp(
            rhs, (0, end), c.first, t_eval=STEP * np.arange(STEPS + 1), rtol=rtol, atol=1e-9, max_step=1.0
        ).y.T
    )


def by_jax(c: Case, python: str, repeats: int) -> dict[str, object]:
    """Least seconds of one run and of the population in JAX, and the last state, by another interpreter."""
    names = c.structure.table.channels
    given = {
        "rudder": c.channels[:, names.index("δ")], "revolutions": np.sqrt(c.channels[0, names.index("|n|n")]),
        "first": c.first, "step": STEP, "coefficients": c.coefficients, "population": candidates(c),
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder) / "case.npz", **given)
        script = Path(__file__).with_name("rollout_jax.py")
        command = [python, str(script), str(Path(folder) / "case.npz"), str(repeats)]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return dict(json.loads(printed.splitlines()[-1]))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--jax-python", help="interpreter of an environment that has JAX")
    chosen = parser.parse_args()
    c = case()
    one = best(lambda: one_rollout(c), chosen.repeats)
    many = best(lambda: population(c, chosen.workers), max(3, chosen.repeats // 4))
    tangents = best(sensitive(c), max(3, chosen.repeats // 4))
    slow = best(lambda: by_scipy(c, 1e-6), 2)
    difference = np.abs(one_rollout(c)[:, 3:6] - by_scipy(c, 1e-9)[:, 3:6]).max()
    rows = (
        ("one rollout, ms", one, 1e3, "≤ 0.5"),
        (f"per candidate of {CANDIDATES}, {chosen.workers} threads, ms", many, 1e3 / CANDIDATES, "≤ 0.15"),
        (f"sensitivities of {DIRECTIONS}, ms", tangents, 1e3, ""),
        ("scipy solve_ivp, ms", slow, 1e3, ""),
    )
    print(f"{STEPS} steps, {len(c.coefficients)} terms")
    print(f"{'':44}{'wall':>10}{'processor':>12}   aim")
    for name, (wall, processor), factor, aim in rows:
        print(f"{name:44}{wall * factor:10.3f}{processor * factor:12.3f}   {aim}")
    for k, label in ((0, "wall"), (1, "processor")):
        print(f"{label}: solve_ivp / rollout {slow[k] / one[k]:.0f} (aim ≥ 400), "
              f"sensitivities / rollout {tangents[k] / one[k]:.1f} (aim ≤ 25)")  # fmt: skip
    print(f"largest difference of u, v, r from solve_ivp at 1e-9: {difference:.1e}")
    if chosen.jax_python:
        peer = by_jax(c, chosen.jax_python, chosen.repeats)
        print(f"JAX {peer['version']}, lax.scan, wall ms: {1e3 * peer['one']:.3f} (ours x {peer['one'] / one[0]:.2f}), "
              f"per candidate {1e3 / CANDIDATES * peer['population']:.3f} "
              f"(ours x {peer['population'] / many[0]:.2f}); "
              f"difference at the end {np.abs(one_rollout(c)[-1, :6] - peer['end']).max():.1e}")  # fmt: skip


if __name__ == "__main__":
    main()
