"""``python -m benchmarks.bench_output_error``: estimates of output error against the Cramér-Rao bound, Monte Carlo.

For each of four vessels of the truth simulator a campaign is recorded and identified once. Its solution then is the
truth: the same logs are made again from the identified model, with fresh noise on every sample (white, or with a wander
of the position, first-order Gauss-Markov), and identified anew, noise levels and all. The bound is that of whole
logs with a free first state each; what is known of a lead of the inputs counts as knowledge, and the true lead of every
draw is one that it allows: held at one value (``--one-lead``) an estimate that knows better is biased towards what it
knows. Only parameters whose bound is under half of their value are counted.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from benchmarks.bench_measured import trials_of
from fixtures.make_campaign import main as make_campaign
from identify import kernel
from identify.base_fit import window_length
from identify.first_states import first_states, state_precision
from identify.fitted import Fitted
from identify.noise import calibrated
from identify.output_error import Solution, solve
from identify.parameter_covariance import covariance_of
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.reduction import reduce
from identify.stretch import Stretch
from identify.whole_windows import over_whole_logs
from identify.windows import Problem, cut, moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Vessel and the model that it is exact in.
VESSELS = (("catamaran", "modulus"), ("usv", "modulus"), ("tanker", "blanke"), ("cybership", "cybership2"))
#: Time constant (s) and size, in units of the white noise, of the position's wander.
WANDER, SIZE = 20.0, 2.0


@dataclass(frozen=True)
class Truth:
    """What the records are drawn from: whole logs, the fit, and the bound (np,)."""

    problem: Problem
    fitted: Fitted
    bound: FloatArray

    def parameters(self, rng: np.random.Generator, *, one_lead: bool) -> FloatArray:
        """True parameters (np,) of a draw: of what is known beforehand a value that this knowledge allows."""
        p = self.fitted.solution.p.copy()
        for k, slot in enumerate(self.fitted.solution.structure.slots):
            if slot.prior is not None and not one_lead:
                p[k] = np.clip(rng.normal(*slot.prior), *slot.parameter.bounds)
        return p

    def predicted(self, p: FloatArray) -> list[FloatArray]:
        """Samples of every log without noise, under parameters (np,)."""
        whole = self.problem
        errors = moments(whole, self.fitted.solution.structure, p, first_states(whole)).residuals
        return _predicted(whole, errors)


def truth_for(vessel: str, model: str, duration: float) -> Truth:
    """Record a campaign of this vessel, identify it, and take the solution for the truth."""
    with tempfile.TemporaryDirectory() as folder:
        names = ["--manoeuvre", "zigzag", "--manoeuvre", "random", "--manoeuvre", "zigzag10"]
        with contextlib.redirect_stdout(io.StringIO()):
            make_campaign([folder, "--vessel", vessel, "--duration", str(duration), "--seed", "3", *names])
        trials = trials_of(Path(folder) / "campaign.toml")
    prepared = prepare([replace(t, role="identify") for t in trials], model)
    fitted = fit_declared(prepared)
    whole = cut(fitted.problem.stretches, 1e9)
    first = first_states(whole)
    s = fitted.solution
    now = moments(whole, s.structure, s.p, first)
    reduced = reduce(now.matrices, first, first, state_precision(s.structure))
    information = reduced.information.sum(axis=0) + np.diag(1.0 / fitted.prior.sd**2)
    bound = np.sqrt(np.diag(np.linalg.inv(information)))
    return Truth(whole, fitted, bound)


def _predicted(whole: Problem, residuals: Sequence[FloatArray]) -> list[FloatArray]:
    out = [s.samples.value.copy() for s in whole.stretches]
    for w, residual in zip(whole.windows, residuals, strict=True):
        out[w.stretch][w.samples] -= residual * whole.stretches[w.stretch].samples.sigma[w.samples, None]
    return out


def drawn(truth: Truth, p: FloatArray, rng: np.random.Generator, wander: bool) -> tuple[Stretch, ...]:
    """The same stretches under true parameters (np,), with fresh noise."""
    made = []
    for s, value in zip(truth.problem.stretches, truth.predicted(p), strict=True):
        samples = s.samples
        noise = rng.standard_normal(value.shape)
        noise[np.isin(samples.kind, (kernel.HEADING, kernel.YAW_RATE)), 1] = 0.0
        if wander:
            mine = np.nonzero(samples.kind == kernel.POSITION)[0]
            noise[mine] += SIZE * _wander(samples.t[mine], rng)
        made.append(replace(s, samples=replace(samples, value=value + noise * samples.sigma[:, None])))
    return tuple(made)


def _wander(t: FloatArray, rng: np.random.Generator) -> FloatArray:
    """First-order Gauss-Markov noise (n, 2) of unit size at evenly spaced times."""
    keep = float(np.exp(-np.median(np.diff(t)) / WANDER))
    white = rng.standard_normal((len(t), 2)) * np.sqrt(1.0 - keep**2)
    white[0] /= np.sqrt(1.0 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], white, axis=0), dtype=float)


def estimate(
    truth: Truth, stretches: tuple[Stretch, ...], rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Parameters and their standard errors, from a start some standard errors off the truth."""
    structure = truth.fitted.solution.structure
    p = truth.fitted.solution.p + 3.0 * truth.bound * rng.standard_normal(len(truth.bound))
    problem = cut(stretches, window_length(structure.vessel.length))
    solution: Solution = solve(problem, structure, p, first_states(problem), truth.fitted.prior)
    for _ in range(2):
        problem = calibrated(problem, solution)
        anchor = first_states(problem)
        solution = solve(
            problem, structure, solution.p, solution.first, truth.fitted.prior, anchor=anchor, budget=10
        )
    fitted = over_whole_logs(Fitted(problem, truth.fitted.prior, solution))
    return fitted.solution.p, np.sqrt(np.diag(covariance_of(fitted)))


def study(
    vessel: str, model: str, draws: int, duration: float, *, wander: bool, one_lead: bool = False
) -> str:
    """A row: RMSE and bias over the bound (worst and median of the parameters), coverage of 95 % intervals."""
    began = time.perf_counter()
    truth = truth_for(vessel, model, duration)
    p, slots = truth.fitted.solution.p, truth.fitted.solution.structure.slots
    kept = np.array([s.coefficient >= 0 for s in slots]) & (truth.bound < 0.5 * np.abs(p))
    found, errors = [], []
    for seed in range(draws):
        rng = np.random.default_rng([seed, 17])
        true = truth.parameters(np.random.default_rng([seed, 18]), one_lead=one_lead)
        values, stderr = estimate(truth, drawn(truth, true, rng, wander), rng)
        found.append(values - true)
        errors.append(stderr)
    off, sd = np.array(found)[:, kept], np.array(errors)[:, kept]
    rmse, bias = (
        np.sqrt(np.mean(off**2, axis=0)) / truth.bound[kept],
        np.abs(off.mean(axis=0)) / truth.bound[kept],
    )
    covered = np.mean(np.abs(off) < 1.96 * sd, axis=0)
    cells = f"{np.median(rmse):.2f} ({rmse.max():.2f}) | {np.median(bias):.2f} ({bias.max():.2f})"
    spread = f"{np.mean(covered):.3f} ({covered.min():.3f}-{covered.max():.3f})"
    kind = "wandering" if wander else "white"
    return (
        f"| {vessel}, {model} | {kind} | {kept.sum()} of {len(p)} | {cells} | {spread} | "
        f"{time.perf_counter() - began:.0f} |"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bench_output_error", description=__doc__)
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--duration", type=float, default=60.0, help="of each of three logs, s")
    parser.add_argument("--vessel", nargs="*", default=[v for v, _ in VESSELS])
    parser.add_argument("--wander", action="store_true", help="only the case of a wandering position")
    parser.add_argument("--one-lead", action="store_true", help="the inputs' lead is the same in every draw")
    a = parser.parse_args(arguments)
    print("| vessel, model | noise | identifiable | RMSE/bound (worst) | bias/bound (worst) | coverage | s |")
    print("|---|---|---|---|---|---|---|")
    for vessel, model in VESSELS:
        if vessel in a.vessel:
            for wander in (True,) if a.wander else (False, True) if vessel == a.vessel[0] else (False,):
                row = study(vessel, model, a.draws, a.duration, wander=wander, one_lead=a.one_lead)
                print(row, flush=True)


if __name__ == "__main__":
    main()
