"""``python -m benchmarks.measured_limits``: what keeps measured runs from being predicted, and what a mean is worth.

Three things, all of ``taylor_modulus`` on the runs of ``bench_measured``. How well one set of coefficients follows
all of them, the unseen ones too, which is more than any rule can reach. How far a constant yaw acceleration may be off
for a run to be predicted as well as is asked for, and how well it is with constants of its own: an unstable ship that
sets out with a slightly other balance goes another way. And what the mean of several fits (``identify.averaged``) is
worth against the best of them alone, on runs that neither they nor their choice have seen.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.bench_measured import CAMPAIGN, FloatArray, line, print_runs, r_squared, scores, trials_of
from identify.averaged import PICKS, Expert, experts_of, mean_of, picked, unseen_of, words_of
from identify.chain import chain_of
from identify.joined import join
from identify.output_error import Prior
from identify.predict import free_run
from identify.prepare import Prepared, prepare
from identify.stretch import Stretch
from identify.structure import Structure
from identify.whole_logs import joined_from_simple

MODEL = "taylor_modulus"
#: R² that is asked for of a run, and of the gentlest.
AIM, GENTLE = 0.95, 0.8
OFFSETS = np.arange(-8e-4, 8.01e-4, 2e-5)  # rad/s²
LOOSE = 10.0


def r2_of(structure: Structure, p: FloatArray, s: Stretch) -> FloatArray:
    """R² (3,) of a free run."""
    with np.errstate(over="ignore", invalid="ignore"):
        return r_squared(s.states[:, 3:6], free_run(structure, p, s)[:, 3:6])


def nested(prepared: Prepared, experts: Sequence[Expert], most: int) -> float:
    """Error of what is picked (the best alone if ``most`` is 1) without the group of runs that it is judged by."""
    structure, stretches = prepared.structure, prepared.identify
    every, found = unseen_of(stretches), []
    for g in every:
        rest = [h for h in every if h != g]
        some = picked(structure, stretches, experts, rest, most).experts
        found.append(mean_of(structure, stretches, some, [g]).error)
    return float(np.exp(np.mean(np.log(found))))


def with_constants(structure: Structure, p: FloatArray, s: Stretch) -> FloatArray:
    """The coefficients with constants in surge, sway and yaw that are this run's own."""
    free = np.array([slot.name in ("X_|n|n", "Y_1", "N_1") for slot in structure.slots])
    found = join(chain_of(structure, [s]), p, Prior(p.copy(), np.where(free, np.inf, 1e-9)))
    return p if found is None else found.p


def allowed(structure: Structure, p: FloatArray, s: Stretch) -> str:
    """Offsets of the constant yaw acceleration, 1e-4 rad/s², at which a run is predicted as well as is asked for."""
    place = next(k for k, slot in enumerate(structure.slots) if slot.name == "N_1")
    aim = GENTLE if "05_01" in s.name else AIM
    good = [d for d in OFFSETS if r2_of(structure, p + d * (np.arange(len(p)) == place), s).min() >= aim]
    return f"{1e4 * min(good):.1f} to {1e4 * max(good):.1f}" if good else "none"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.measured_limits", description=__doc__)
    parser.add_argument("campaign", type=Path, nargs="?", default=CAMPAIGN)
    a = parser.parse_args(arguments)
    trials = trials_of(a.campaign)
    prepared = prepare(trials, MODEL)
    structure, stretches = prepared.structure, prepared.identify
    experts, every = experts_of(structure, stretches), unseen_of(stretches)
    best, mean = (picked(structure, stretches, experts, every, most) for most in (1, PICKS))
    print(f"{words_of(mean)} Picked without the run as well: {nested(prepared, experts, PICKS):.3f}, the best alone "
          f"{nested(prepared, experts, 1):.3f}.")  # fmt: skip
    name = f"{best.experts[0].model} {best.experts[0].ridge:g}"
    for label, p in ((name, best.p), ("mean", mean.p)):
        found = scores(prepared, p)
        print(line(label, found, 0.0))
        print_runs(found)
    runs = prepare([replace(t, role="identify") for t in trials], MODEL)
    together = joined_from_simple(runs.structure, runs.identify, LOOSE)
    print(
        f"\n| run | {name} | own constants | offsets of N_1 allowed | fitted to all runs |\n|---|---|---|---|---|"
    )
    for s in runs.identify:
        fits = [best.p, with_constants(runs.structure, best.p, s), *([together.p] if together else [])]
        cells = [" ".join(f"{x:.3f}" for x in r2_of(runs.structure, p, s)) for p in fits]
        cells.insert(2, allowed(runs.structure, best.p, s))
        print(f"| {s.name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
