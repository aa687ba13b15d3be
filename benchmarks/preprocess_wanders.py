# ruff: noqa: ANN001
"""Errors of the position that wander: what is told of them, and how honest the velocities are."""

from __future__ import annotations

import numpy as np

from benchmarks.preprocess_cases import SAILED, Imperfect, sampled, trial_of, truth_of


def wanders(seeds: int, sailed=SAILED) -> None:
    print(
        "\nwander of the position, 0.03 L rms over 90 s, beside 0.02 m white: white ÷ true, wander per root of"
    )
    print("time ÷ true (0: not told from the motion), error of u and v ÷ stated (root mean square)")
    for vessel, manoeuvre in sailed:
        for doppler in (False, True):
            rows = [wandering(vessel, manoeuvre, seed, doppler) for seed in range(seeds)]
            white, walk, pull = np.mean(rows, axis=0)
            print(
                f"  {vessel:10s}{manoeuvre:8s}{'with velocity' if doppler else 'position only':15s}"
                f"white {white:.3f}  wander {walk:.2f}  pull {pull:.2f}"
            )


def wandering(vessel: str, manoeuvre: str, seed: int, doppler: bool) -> tuple[float, float, float]:
    sensors = {"position": Imperfect(5, 0.02), "heading": Imperfect(10, 0.01)}
    sensors |= {"yaw_rate": Imperfect(10, 0.003)} | ({"velocity": Imperfect(5, 0.05)} if doppler else {})
    made = sampled(truth_of(vessel, manoeuvre, 150.0, seed), seed, **sensors)
    level, t = 0.03 * made.vessel.length, made.log.tables["position"].index.to_numpy() * 1e-9
    made.log.tables["position"] += gauss_markov(t, level, 90.0, np.random.default_rng(seed + 99))
    trial = trial_of(made)
    m, s = trial.measurements["position"], trial.states
    walk = m.wander / np.sqrt(m.correlation_time) if m.correlation_time else 0.0
    keep = (s["t"] > 5.0) & (s["t"] < 145.0)
    z = [
        (s[k] - np.interp(s["t"], made.truth.t, getattr(made.truth, k)))[keep] / s[f"sigma_{k}"][keep]
        for k in "uv"
    ]
    return m.sigma / 0.02, walk / (level / np.sqrt(90.0)), float(np.sqrt(np.mean(np.square(z))))


def gauss_markov(t, level: float, time: float, rng) -> np.ndarray:
    """First-order Gauss-Markov noise (n, 2) at any times."""
    keep = np.exp(-np.diff(t, prepend=-np.inf) / time)
    kicks = level * np.sqrt(1.0 - keep**2)[:, None] * rng.standard_normal((len(t), 2))
    for i in range(1, len(t)):
        kicks[i] += keep[i] * kicks[i - 1]
    return kicks
