"""``python -m benchmarks.bench_overshoots CAMPAIGN``: overshoots of unseen zigzags, measured and by ``simulate``.

The runs' names end in ``Z_RUDDER_HEADING``, degrees, as those of KVLCC2 do. The model is fitted to the runs with role
identify as a run does it far from the noise; of the others only rudder angle, heading and side are used.
"""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.bench_measured import CAMPAIGN, trials_of
from identify.left_out import errors_in_parts
from identify.misfit import DRAWS, SMALL
from identify.parameter_covariance import covariance_of
from identify.predict import free_run
from identify.prediction_fit import fit_far_from_noise
from identify.prepare import prepare
from identify.report_fit import make_fit
from identify.simulate import Measure, parse_order, simulate
from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Rate of the rudder of these tests, rad/s (15.8 deg/s), and how late it begins to move, s, as their logs show it.
HELM_RATE, HELM_DELAY = 0.2758, 0.25
NAMES = ("first_overshoot", "second_overshoot")


def angles_of(name: str) -> tuple[float, float]:
    """Rudder and heading of a run by its name, degrees."""
    found = re.search(r"Z_(\d+)_(\d+)", name)
    if found is None:
        raise SystemExit(f"{name}: expected a name with Z_RUDDER_HEADING in it.")
    return float(found[1]), float(found[2])


def overshoots(stretch: Stretch, psi: FloatArray, heading: float) -> tuple[int, list[float]]:
    """Side of the first turn, and how far ``psi`` (n,) overshoots after the rudder's first two reversals, degrees."""
    rudder = stretch.inputs["rudder"]
    angle = np.interp(stretch.grid, rudder.t, rudder.value)
    full = np.where(np.abs(angle) > 0.5 * np.abs(angle).max(), np.sign(angle), 0.0)
    begun = np.nonzero(full)[0]
    changes = [begun[0], *(k for j, k in pairwise(begun) if full[j] != full[k]), len(full) - 1]
    psi = np.degrees(psi - psi[0])
    side = int(np.sign(psi[changes[1]]))
    spans = zip((side, -side), changes[1:3], changes[2:4], strict=False)
    return side, [float((s * psi[a : b + 1]).max()) - heading for s, a, b in spans]


def shown(measure: Measure) -> str:
    """A simulated overshoot with its 95 % interval, degrees."""
    low, high = math.degrees(measure.low), math.degrees(measure.high)
    return f"{math.degrees(measure.value):.1f} ({low:.1f} to {high:.1f})"


def covered(structure: Structure, p: FloatArray, covariance: FloatArray, stretch: Stretch) -> float:
    """Share of u, v, r over thirds of a run, predicted freely, that lies in its 95 % interval (linear in ``p``)."""
    values, vectors = np.linalg.eigh(covariance)
    root = SMALL * vectors * np.sqrt(np.maximum(values, 0.0))
    error = errors_in_parts(structure, p, stretch)
    moves = np.random.default_rng(0).standard_normal((DRAWS, len(p))) @ root.T
    moved = [errors_in_parts(structure, p + m, stretch) - error for m in moves]
    return float(np.mean(np.abs(error) < 1.96 * np.sqrt(np.mean(np.square(moved), axis=0)) / SMALL))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bench_overshoots", description=__doc__)
    parser.add_argument("campaign", type=Path, nargs="?", default=CAMPAIGN)
    parser.add_argument("--model", default="taylor_modulus")
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("--delay", type=float, default=HELM_DELAY, help="of the helm, s")
    a = parser.parse_args(arguments)
    trials = trials_of(a.campaign)
    prepared = prepare(trials, a.model)
    fitted = fit_far_from_noise(prepared.structure, prepared.identify)
    fit = make_fit(prepared, fitted, estimator="output_error", optimiser="auto", seed=0)
    print(f"{a.model}: overshoots of runs that were not seen, degrees")
    held: list[bool] = []
    print("| run | first: measured, free run with its rudder, simulated | second |\n|---|---|---|")
    for stretch in prepared.validate:
        rudder, heading = angles_of(stretch.name)
        side, measured = overshoots(stretch, stretch.states[:, 2], heading)
        _, free = overshoots(stretch, free_run(prepared.structure, fitted.solution.p, stretch)[:, 2], heading)
        order = replace(
            parse_order(f"zigzag {rudder:g}/{heading:g}"),
            side=side,
            helm_rate=HELM_RATE,
            helm_delay=a.delay,
            samples=a.samples,
        )
        done = simulate(fit, order, 0)
        held += [
            measure.low <= math.radians(m) <= measure.high
            for m, measure in zip(measured, (done[n] for n in NAMES), strict=False)
        ]
        cells = [
            f"{m:.1f}, {f:.1f}, {shown(done[n])}" for m, f, n in zip(measured, free, NAMES, strict=False)
        ]
        label = f"{rudder:g}/{heading:g} {'starboard' if side > 0 else 'port'}"
        print(f"| {label} | {' | '.join(cells)} |", flush=True)
    print(f"{sum(held)} of {len(held)} measured overshoots lie in their 95 % interval")
    for name, one in (("as stated", fitted), ("as the noise alone has them", replace(fitted, refits=()))):
        structure, p, covariance = prepared.structure, fitted.solution.p, covariance_of(one)
        shares = [covered(structure, p, covariance, s) for s in prepared.validate]
        print(f"u, v, r of free runs in their 95 % intervals, {name}: {np.mean(shares):.3f} "
              f"({min(shares):.2f}-{max(shares):.2f})")  # fmt: skip


if __name__ == "__main__":
    main()
