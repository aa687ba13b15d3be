# ruff: noqa: ANN001
"""Accuracy of preprocessing beside other methods; outliers; noise levels."""

from __future__ import annotations

import numpy as np

from benchmarks.preprocess_cases import (
    CASES,
    CHANNELS,
    INERTIAL,
    NOISE,
    SAILED,
    Imperfect,
    errors,
    inertial,
    make,
    rates_of,
    sampled,
    trial_of,
    truth_of,
)
from benchmarks.preprocess_rivals import METHODS, OBSERVERS, given
from preprocess.outliers import robust_three_sigma, sliding_three_sigma


def accuracy(seeds: int, cases=CASES) -> None:
    print("RMSE of body velocities and accelerations (m/s, rad/s, m/s², rad/s²), median over seeds")
    for case in cases:
        table: dict[str, list[np.ndarray]] = {}
        for seed in range(seeds):
            made = make(case, seed)
            trial = trial_of(made)
            table.setdefault("default", []).append(errors(trial.states, made.truth))
            table.setdefault("given", []).append(errors(given(trial, made), made.truth))
            table.setdefault("given, plain", []).append(errors(given(trial, made, plain=True), made.truth))
            for name, method in OBSERVERS.items():
                table.setdefault(name, []).append(errors(method(made), made.truth))
            for name, method in METHODS.items():
                table.setdefault(name, []).append(errors(method(trial), made.truth))
        print(f"\n{rates_of(case)}")
        best = np.median(table["given"], axis=0)
        for name, rows in table.items():
            row = np.median(rows, axis=0)
            print(f"  {name:15s}" + "".join(f"{c:>4s} {x:8.5f}" for c, x in zip(CHANNELS, row, strict=True)))
            if name == "default":
                ratio = row / best
                print(
                    "   ÷ given       "
                    + "".join(f"{c:>4s} {x:8.3f}" for c, x in zip(CHANNELS, ratio, strict=True))
                )


def accelerations(seeds: int, cases=INERTIAL) -> None:
    """What measured accelerations add: error of the default with them over that without."""
    print(
        "\naccelerations at 50 Hz, a boat that rolls: RMSE with ÷ without, median over seeds; used in so many"
    )
    for vessel, manoeuvre, rates, noise in cases:
        rows, used = [], 0
        for seed in range(seeds):
            both = [trial_of(inertial(vessel, manoeuvre, rates, noise, seed, keep)) for keep in (True, False)]
            truth = truth_of(vessel, manoeuvre, 120.0, seed)
            found, plain = (errors(t.states, truth) for t in both)
            rows.append(found / plain)
            used += any(s.action == "accelerations" and s.arguments["used"] for s in both[0].history)
        ratio = "".join(f"{c:>4s} {x:6.3f}" for c, x in zip(CHANNELS, np.median(rows, axis=0), strict=True))
        print(
            f"  {vessel} {manoeuvre}, {'/'.join(map(str, rates))} Hz, {noise} m/s²: {ratio}; {used} of {seeds}"
        )


def outliers_and_levels(seeds: int, cases=CASES) -> None:
    print("\nnoise levels found ÷ true; recall and false alarms (default; plain 3σ; sliding 3σ alone)")
    for case in cases:
        case = (*case[:4], 0.05)
        ratio: dict[str, list[float]] = {}
        count = np.zeros((3, 4))
        for seed in range(seeds):
            made = make(case, seed)
            trial = trial_of(made)
            for name, sigma in list(NOISE.items())[:3]:
                m, bad = trial.measurements[name], made.bad[name]
                ratio.setdefault(name, []).append(m.sigma / sigma)
                columns = np.reshape(m.value, (len(m.t), -1)).T
                plain = np.any([robust_three_sigma(c) for c in columns], axis=0)
                for k, mark in enumerate((~m.good, plain, sliding_three_sigma(m.t, m.value, 4.0))):
                    count[k] += [mark[bad].sum(), bad.sum(), mark[~bad].sum(), (~bad).sum()]
        levels = ", ".join(f"{k} {np.mean(v):.3f}" for k, v in ratio.items())
        shown = "; ".join(f"{c[0] / c[1]:.3f} {c[2] / c[3]:.4f}" for c in count)
        print(f"  {case[0]:10s} {case[1]:8s} {levels} | {shown}")


def levels_by_rate(seeds: int, sailed=SAILED) -> None:
    print(
        "\nnoise levels found ÷ true, mean ± its standard error (scatter of the logs) over vessels and seeds, by"
    )
    print("rate of the position; every log has noise of its own")
    print("(heading twice, gyro four times as often, to 20 Hz; velocity as often as the position); 10 % lost")
    for rate in (1, 2, 5, 10, 20):
        ratio: dict[str, list[float]] = {}
        for number, (vessel, manoeuvre) in enumerate(sailed):
            for seed in range(100 * number, 100 * number + seeds):
                rates = dict(zip(NOISE, (rate, min(2 * rate, 20), min(4 * rate, 20), rate), strict=True))
                sensors = {k: Imperfect(rates[k], s, 0.2, 0.1) for k, s in NOISE.items()}
                found = trial_of(sampled(truth_of(vessel, manoeuvre, 90.0, seed), seed, **sensors))
                for k, s in NOISE.items():
                    ratio.setdefault(k, []).append(found.measurements[k].sigma / s)
        shown = ", ".join(
            f"{k} {np.mean(v):.3f} ± {np.std(v) / np.sqrt(len(v)):.3f} ({np.std(v):.3f})"
            for k, v in ratio.items()
        )
        print(f"  {rate:3d} Hz: {shown}")
