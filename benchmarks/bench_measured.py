"""``python -m benchmarks.bench_measured CAMPAIGN``: unseen runs of measured model tests, predicted free-running.

Every method is identified on the campaign's runs with role identify and predicts the others from their first state and
their rudder alone. ``auto`` chooses its model inside the runs to identify on. Scores are R² per run and channel.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.measured_peers import PEERS
from identify.choose_model import Considered, choose_model
from identify.predict import free_run
from identify.prediction_fit import fit_far_from_noise
from identify.prepare import Prepared, prepare
from identify.whole_logs import regression_start
from preprocess.trial import Trial
from preprocess.trials import make_trials
from seatrial import load_campaign
from seatrial.pipeline import read_logs, runs_of

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

CAMPAIGN = Path(__file__).parents[2] / "shared" / "data" / "kvlcc2-hsva" / "campaign.toml"
MODELS = ("taylor_modulus", "taylor3", "abkowitz", "blanke", "cybership2")
LEAST_SQUARES = ("taylor3", "abkowitz", "blanke")


def trials_of(path: Path) -> list[Trial]:
    """The campaign's trials."""
    campaign = load_campaign(path)
    sensors = {s.quantity: s for s in campaign.sensors}
    runs = runs_of(campaign, read_logs(campaign, 1))
    return list(make_trials(runs, campaign.vessel, campaign.inputs, sensors))


def r_squared(measured: FloatArray, predicted: FloatArray) -> FloatArray:
    """R² (3,) of u, v, r; a prediction that ran away counts as thirty spreads off."""
    spread = measured.std(axis=0)
    error = np.nan_to_num((predicted - measured) / spread, nan=30.0)
    return np.asarray(1.0 - np.mean(np.clip(error, -30.0, 30.0) ** 2, axis=0), dtype=float)


def scores(prepared: Prepared, p: FloatArray) -> dict[str, FloatArray]:
    """R² per unseen run."""
    return {
        s.name: r_squared(s.states[:, 3:6], free_run(prepared.structure, p, s)[:, 3:6])
        for s in prepared.validate
    }


def line(name: str, found: dict[str, FloatArray], seconds: float) -> str:
    """A row of the table: medians, worst, the gentlest run, seconds."""
    table = np.array(list(found.values()))
    gentle = next((r for n, r in found.items() if "05_01" in n), table[0])
    rest = np.array([r for n, r in found.items() if "05_01" not in n])
    cells = [*np.median(table, axis=0), rest.min(), *gentle]
    return f"| {name} | " + " | ".join(f"{c:.3f}" for c in cells) + f" | {seconds:.0f} |"


def print_runs(found: dict[str, FloatArray]) -> None:
    """R² of u, v, r, a line per run."""
    for name, values in found.items():
        print(f"  {name}: " + " ".join(f"{x:.3f}" for x in values))


def fitted(trials: Sequence[Trial], model: str) -> tuple[dict[str, FloatArray], float]:
    """Scores and processor seconds of the default estimator, as it ends where no model comes near the noise."""
    prepared = prepare(trials, model)
    began = time.process_time()
    p = fit_far_from_noise(prepared.structure, prepared.identify).solution.p
    return scores(prepared, p), time.process_time() - began


def by_regression(trials: Sequence[Trial], model: str) -> tuple[dict[str, FloatArray], float]:
    """Scores and processor seconds of plain least squares of the smoothed accelerations."""
    prepared = prepare(trials, model)
    began = time.process_time()
    p, _ = regression_start(prepared.structure, prepared.identify)
    return scores(prepared, p), time.process_time() - began


def peers(trials: Sequence[Trial], python: str) -> Iterator[str]:
    """Rows of the peers, run by another interpreter."""
    prepared = prepare(trials, "blanke")
    stretches = (*prepared.identify, *prepared.validate)
    arrays: dict[str, object] = {"h": stretches[0].h}
    for k, s in enumerate(stretches):
        rudder = next(m for n, m in s.inputs.items() if n == "rudder")
        arrays |= {
            f"states_{k}": s.states[:, 3:6], f"inputs_{k}": np.interp(s.grid, rudder.t, rudder.value)[:, None],
            f"identify_{k}": s.role == "identify",
        }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "runs.npz", Path(folder) / "found.npz"
        np.savez(source, **arrays)  # type: ignore[arg-type]
        began = time.perf_counter()
        script = Path(__file__).with_name("measured_peers.py")
        subprocess.run([python, str(script), str(source), str(target)], check=True)
        seconds = time.perf_counter() - began
        found = dict(np.load(target))
    for name in PEERS:
        if f"{name}/error" in found:
            yield f"| {name} | {found[f'{name}/error']} |"
        else:
            r2 = {
                s.name: r_squared(s.states[:, 3:6], found[f"{name}/{k}"])
                for k, s in enumerate(stretches)
                if s.role == "validate"
            }
            yield line(name, r2, seconds)


def automatic(trials: Sequence[Trial]) -> tuple[str, dict[str, FloatArray], float, tuple[Considered, ...]]:
    """What ``auto`` chooses, its scores, processor seconds of choice and fit, and what was considered."""
    began = time.process_time()
    name, table = choose_model(trials)
    seconds = time.process_time() - began
    found, more = fitted(trials, name)
    return name, found, seconds + more, table


def fewer(trials: Sequence[Trial], model: str, counts: Sequence[int]) -> Iterator[str]:
    """A model, or what ``auto`` chooses, identified on fewer runs, the gentlest and the hardest kept longest."""
    used = [t.name for t in trials if t.role == "identify"]
    for n in counts:
        kept = {used[round(k)] for k in np.linspace(0, len(used) - 1, n)} if n > 1 else {used[-1]}
        some = [t if t.name in kept or t.role != "identify" else replace(t, role="unused") for t in trials]
        label = f"{n} run{'s' if n > 1 else ''}"
        if model == "auto":
            name, found, seconds, _ = automatic(some)
            yield line(f"auto: {name}, {label}", found, seconds)
        else:
            yield line(f"{model}, {label}", *fitted(some, model))


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bench_measured", description=__doc__)
    parser.add_argument("campaign", type=Path, nargs="?", default=CAMPAIGN)
    parser.add_argument("--models", nargs="*", default=list(MODELS))
    parser.add_argument("--no-auto", action="store_true")
    parser.add_argument("--fewer-models", nargs="*", default=["blanke", "auto"])
    parser.add_argument("--fewer", type=int, nargs="*", default=[5, 4, 3, 2])
    parser.add_argument("--peer-python", help="interpreter of an environment that has the peers")
    a = parser.parse_args(arguments)
    trials = trials_of(a.campaign)
    print(
        "| method | median u | median v | median r | worst of six | 5/1 u | 5/1 v | 5/1 r | s |\n"
        + "|---" * 9
        + "|"
    )
    if not a.no_auto:
        name, found, seconds, table = automatic(trials)
        print(line(f"auto: {name}", found, seconds), flush=True)
        print_runs(found)
        print("left out: " + ", ".join(f"{c.name} {c.error:.3f}" for c in table), flush=True)
    for model in a.models:
        print(line(model, *fitted(trials, model)), flush=True)
    for model in LEAST_SQUARES:
        print(line(f"{model}, least squares", *by_regression(trials, model)), flush=True)
    for row in peers(trials, a.peer_python) if a.peer_python else ():
        print(row, flush=True)
    for model in a.fewer_models:
        for row in fewer(trials, model, a.fewer):
            print(row, flush=True)


if __name__ == "__main__":
    main()
