"""The compiled rollout: alone, over a population, with sensitivities, and beside scipy's solve_ivp.

Wall-clock seconds, the best of several repeats; on a machine that does other things too, look at the processor seconds.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
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


Rate = Callable[[float, np.ndarray], np.ndarray]


def in_python(c: Case) -> Rate:
    """The time derivative of the state (8,) as a person writes the 27 terms in Python, in plain numbers."""
    x, y, n = (HULL[dof] for dof in "uvr")
    rudder = c.channels[:, c.structure.table.channels.index("δ")].tolist()
    thrust = float(c.channels[0, c.structure.table.channels.index("|n|n")])
    turns = math.sqrt(thrust)

    def sideways(k: dict[str, float], u: float, v: float, r: float, d: float) -> float:
        return (
            k["ur"] * u * r + k["uv"] * u * v + k["v"] * v + k["|v|v"] * abs(v) * v + k["|r|v"] * abs(r) * v
            + k["r"] * r + k["|v|r"] * abs(v) * r + k["|r|r"] * abs(r) * r + k["|u|uδ"] * abs(u) * u * d
            + k["|u|u|δ|δ"] * abs(u) * u * abs(d) * d
        )  # fmt: skip

    def rate(time_: float, z: np.ndarray) -> np.ndarray:
        psi, u, v, r = z[2:6].tolist()
        d = rudder[min(int(time_ / STEP), STEPS - 1)]
        forward = (
            x["u"] * u + x["|u|u"] * abs(u) * u + x["u³"] * u**3 + x["vr"] * v * r + x["r²"] * r * r
            + x["|n|n"] * thrust + x["|n|u"] * turns * u
        )  # fmt: skip
        s, k = math.sin(psi), math.cos(psi)
        return np.array([
            u * k - v * s, u * s + v * k, r, forward, sideways(y, u, v, r, d), sideways(n, u, v, r, d), 0.0, 0.0,
        ])  # fmt: skip

    return rate


def by_scipy(c: Case, rtol: float) -> np.ndarray:
    """States (n + 1, 8) by solve_ivp RK45, as a person calls it."""
    end = STEPS * STEP
    found = solve_ivp(
        in_python(c), (0, end), c.first, t_eval=STEP * np.arange(STEPS + 1), rtol=rtol, atol=1e-3 * rtol, max_step=1.0
    )  # fmt: skip
    return np.asarray(found.y.T)


def exact(c: Case) -> np.ndarray:
    """States (n + 1, 8) to 1e-12: piece by piece between the rudder's switches."""
    rudder, rate = c.channels[:, c.structure.table.channels.index("δ")], in_python(c)
    edges = [0, *(np.nonzero(np.diff(rudder))[0] + 1).tolist(), STEPS]
    states = [c.first[None]]
    for a, b in pairwise(edges):
        inside = (STEP * (a + 1e-6), STEP * (b - 1e-6))
        piece = solve_ivp(
            lambda t, z, inside=inside: rate(min(max(t, inside[0]), inside[1]), z), (STEP * a, STEP * b),
            states[-1][-1], t_eval=STEP * np.arange(a, b + 1), rtol=1e-12, atol=1e-13, method="DOP853",
        )  # fmt: skip
        states.append(piece.y.T[1:])
    return np.vstack(states)


def wrong(states: np.ndarray, true: np.ndarray) -> str:
    """Largest error of u, v, r and of the position."""
    off = np.abs(states - true)
    return f"{off[:, 3:6].max():.0e} m/s or rad/s, {off[:, :2].max():.0e} m"


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
    true = exact(c)
    slow = {rtol: best(lambda r=rtol: by_scipy(c, r), 5) for rtol in (1e-6, 1e-8)}
    rows = (
        ("one rollout, ms", one, 1e3, "≤ 0.5"),
        (f"per candidate of {CANDIDATES}, {chosen.workers} threads, ms", many, 1e3 / CANDIDATES, "≤ 0.15"),
        (f"sensitivities of {DIRECTIONS}, ms", tangents, 1e3, ""),
        *((f"scipy solve_ivp at {rtol:.0e}, ms", taken, 1e3, "") for rtol, taken in slow.items()),
    )
    print(f"{STEPS} steps, {len(c.coefficients)} terms")
    print(f"{'':44}{'wall':>10}{'processor':>12}   aim")
    for name, (wall, processor), factor, aim in rows:
        print(f"{name:44}{wall * factor:10.3f}{processor * factor:12.3f}   {aim}")
    for k, label in ((0, "wall"), (1, "processor")):
        ratios = ", ".join(f"{taken[k] / one[k]:.0f} at {rtol:.0e}" for rtol, taken in slow.items())
        print(f"{label}: solve_ivp / rollout {ratios} (aim ≥ 400), "
              f"sensitivities / rollout {tangents[k] / one[k]:.1f} (aim ≤ 25)")  # fmt: skip
    print(f"error: rollout {wrong(one_rollout(c), true)}")
    for rtol in slow:
        print(f"       solve_ivp at {rtol:.0e} {wrong(by_scipy(c, rtol), true)}")
    if chosen.jax_python:
        peer = by_jax(c, chosen.jax_python, chosen.repeats)
        print(f"JAX {peer['version']}, lax.scan, wall ms: {1e3 * peer['one']:.3f} (ours x {peer['one'] / one[0]:.2f}), "
              f"per candidate {1e3 / CANDIDATES * peer['population']:.3f} "
              f"(ours x {peer['population'] / many[0]:.2f}); "
              f"difference at the end {np.abs(one_rollout(c)[-1, :6] - peer['end']).max():.1e}")  # fmt: skip


if __name__ == "__main__":
    main()
