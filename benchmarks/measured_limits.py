"""``python -m benchmarks.measured_limits``: what keeps measured runs from being predicted, and whether averages help.

Three things, all of ``taylor_modulus`` on the runs of ``bench_measured``. How well one set of coefficients follows
all of them, the unseen ones too, which is more than any rule can reach. How far a constant yaw acceleration may be off
for a run to be predicted as well as is asked for, and how well it is with constants of its own: an unstable ship that
sets out with a slightly other balance goes another way. And an average of the coefficients of fits of several models
and priors, picked greedily (Caruana et al. 2004) by their errors on runs that were left out: the accelerations of
models that are parts of one another add up to a model.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.bench_measured import CAMPAIGN, FloatArray, line, print_runs, r_squared, scores, trials_of
from identify.chain import chain_of, spreads
from identify.joined import join
from identify.left_out import CAP, by_prior, errors_in_parts, groups_of
from identify.output_error import Prior
from identify.predict import free_run
from identify.prepare import Prepared, prepare
from identify.stretch import Stretch
from identify.structure import Structure
from identify.whole_logs import joined_from_simple
from preprocess.trial import Trial

MODEL, PARTS_OF_IT = "taylor_modulus", ("taylor3", "blanke")
#: R² that is asked for of a run, and of the gentlest.
AIM, GENTLE = 0.95, 0.8
OFFSETS = np.arange(-8e-4, 8.01e-4, 2e-5)  # rad/s²
PICKS = 8
LOOSE = 10.0


@dataclass(frozen=True)
class Expert:
    """Coefficients (np,) of the fit to all runs, and of those without each group of them."""

    name: str
    p: FloatArray
    without: tuple[FloatArray, ...]


def r2_of(structure: Structure, p: FloatArray, s: Stretch) -> FloatArray:
    """R² (3,) of a free run."""
    with np.errstate(over="ignore", invalid="ignore"):
        return r_squared(s.states[:, 3:6], free_run(structure, p, s)[:, 3:6])


def experts_of(trials: Sequence[Trial], prepared: Prepared) -> list[Expert]:
    """Every model that is a part of ``MODEL``, and itself, with every prior."""
    made = []
    for name in (MODEL, *PARTS_OF_IT):
        own = prepare(trials, name)
        for found in by_prior(own.structure, own.identify):
            groups = {r.unseen: r.p for r in found.refits}
            wanted = [frozenset(g) for g in groups_of(own.identify)]
            if all(g in groups for g in wanted):
                ps = [_as_whole(prepared, own, q) for q in (found.joined.p, *(groups[g] for g in wanted))]
                made.append(Expert(f"{name} {found.ridge:g}", ps[0], tuple(ps[1:])))
    return made


def _as_whole(prepared: Prepared, own: Prepared, q: FloatArray) -> FloatArray:
    """Coefficients as those of ``MODEL``; a constant in surge goes with the thrust, for revolutions are constant."""
    whole = prepared.structure
    p = whole.carried(q, own.structure)
    index = {own.structure.key(s): k for k, s in enumerate(own.structure.slots)}
    if ("", "X_1") in index:
        turns = float(np.median(prepared.identify[0].inputs["propeller"].value))
        place = [whole.key(s) for s in whole.slots].index(("", "X_|n|n"))
        p[place] += q[index["", "X_1"]] / (turns * abs(turns))
    return p


def picked(prepared: Prepared, experts: Sequence[Expert], groups: Sequence[int]) -> list[Expert]:
    """The experts whose average predicts groups of runs best that none of them saw; some more than once."""
    best: tuple[float, list[Expert]] = (np.inf, [])
    chosen: list[Expert] = []
    for _ in range(PICKS):
        tried = [[*chosen, e] for e in experts]
        errors = [error_of(prepared, some, groups) for some in tried]
        chosen = tried[int(np.argmin(errors))]
        best = min(best, (min(errors), chosen), key=lambda b: b[0])
    return best[1]


def error_of(prepared: Prepared, some: Sequence[Expert], groups: Sequence[int]) -> float:
    """Geometric mean over groups of runs of the error of the average that has not seen them."""
    every, spread = groups_of(prepared.identify), spreads(prepared.identify)
    found = []
    for g in groups:
        p = np.mean([e.without[g] for e in some], axis=0)
        errors = [
            errors_in_parts(prepared.structure, p, prepared.identify[k]) / spread[k] for k in sorted(every[g])
        ]
        capped = np.clip(np.nan_to_num(np.vstack(errors), nan=CAP), -CAP, CAP)
        found.append(min(float(np.sqrt(np.mean(capped**2))), 1.0))
    return float(np.exp(np.mean(np.log(found))))


def nested(prepared: Prepared, experts: Sequence[Expert], most: int) -> float:
    """Error of what is picked (``most`` experts of them) without the group of runs that it is judged by."""
    every = range(len(groups_of(prepared.identify)))
    found = []
    for g in every:
        rest = [h for h in every if h != g]
        alone = [error_of(prepared, [e], rest) for e in experts]
        some = picked(prepared, experts, rest) if most > 1 else [experts[int(np.argmin(alone))]]
        found.append(error_of(prepared, some, [g]))
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
    experts, every = experts_of(trials, prepared), range(len(groups_of(prepared.identify)))
    best = min(experts, key=lambda e: error_of(prepared, [e], every))
    some = picked(prepared, experts, every)
    print(f"average of {', '.join(e.name for e in some)}")
    print(f"error of runs left out: average {error_of(prepared, some, every):.3f}, best alone ({best.name}) "
          f"{error_of(prepared, [best], every):.3f}; chosen without the run as well: "
          f"{nested(prepared, experts, PICKS):.3f}, {nested(prepared, experts, 1):.3f}")  # fmt: skip
    for name, p in ((best.name, best.p), ("average", np.mean([e.p for e in some], axis=0))):
        found = scores(prepared, p)
        print(line(name, found, 0.0))
        print_runs(found)
    runs = prepare([replace(t, role="identify") for t in trials], MODEL)
    together = joined_from_simple(runs.structure, runs.identify, LOOSE)
    print(
        f"\n| run | {best.name} | own constants | offsets of N_1 allowed | fitted to all runs |\n|---|---|---|---|---|"
    )
    for s in runs.identify:
        fits = [best.p, with_constants(runs.structure, best.p, s), *([together.p] if together else [])]
        cells = [" ".join(f"{x:.3f}" for x in r2_of(runs.structure, p, s)) for p in fits]
        cells.insert(2, allowed(runs.structure, best.p, s))
        print(f"| {s.name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
