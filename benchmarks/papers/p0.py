"""Xie et al. 2020 (ABEL): the experiment behind tables 3, 5 and 6, the paper's methods and ours.

What the paper leaves out, and what is assumed: 200 s at 0.1 s; the propeller at the revolutions that hold
1.179 m/s; rudder at 15.8 deg/s; C = 1e4 of columns of unit size, or 1e2 of columns as they come ("as printed": with U
fixed and the rudder in degrees, as table 4 has them), C_b = 1; bandwidths from 0.5 rad/s (more for quicker ships) over
a range of 6 (κ = 3); the fitness searched is the free-running error on the training data;
the disturbance of eq. 35 is added to the measured states. Every method is scored by its free run against the
undisturbed truth of the same manoeuvre: u + v + L r, the tables' fitness (eq. 29 prints u + v + r).

"auto" is the library's default estimator on the paper's model, "auto, model too" lets it choose among its own models by
the prediction of parts that it left out, which a single zigzag gives it little of. Both get u, v, r as measured, the
rudder, and a heading that is only the integral of the measured r.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from benchmarks.papers.abkowitz import SIZES, errors, regressors
from benchmarks.papers.kvlcc2 import SPEED, STEP, Run, zigzag
from benchmarks.papers.library import Sensed, free_run, identify, trial_of
from benchmarks.papers.record import Record
from identify.estimators import ESTIMATORS
from identify.estimators.estimate import FloatArray
from identify.optimisers import OPTIMISERS, minimise
from preprocess.eso import Observer, filter_like, observe
from preprocess.vessel import Vessel

C = 1e4
BUDGET = 4 + 2 + 4 * 20 * 3  # table 2: 4 beetles, 20 iterations, three evaluations each, and the start
QUICK: Mapping[str, Any] = {"C": C, "covariance": "none"}


@dataclass(frozen=True)
class Case:
    """What is measured, and the truth that a fit is scored on."""

    t: FloatArray
    states: FloatArray
    delta: FloatArray
    truth: Run
    speed: float = SPEED
    length: float = 7.0

    @property
    def quickness(self) -> float:
        """How much quicker than the tanker: speed over length."""
        return self.speed / self.length * 7.0 / SPEED

    @property
    def bandwidths(self) -> tuple[float, float]:
        """Range of the observers' bandwidths that is searched, rad/s; κ = 3 makes it 6 wide (table 2)."""
        return 0.5 * self.quickness, 0.5 * self.quickness + 6.0

    @property
    def noisy(self) -> bool:
        """Whether another draw gives another case."""
        return len(self.t) != len(self.truth.t) or not np.array_equal(self.states, self.truth.states)


def clean(angle_deg: float, duration: float = 200.0) -> Case:
    """Undisturbed zigzag."""
    run = zigzag(angle_deg, duration)
    return Case(run.t, run.states, run.delta, run)


def disturbed(case: Case, level: float, seed: int) -> Case:
    """Eq. 35: F (sin(0.3 π i) + 2 r - 1) with F = level · |x| and r uniform, on each state."""
    index = np.arange(len(case.t))[:, None]
    random = np.random.default_rng(seed).random(case.states.shape)
    noise = level * np.abs(case.states) * (np.sin(0.3 * np.pi * index) + 2 * random - 1)
    return replace(case, states=case.states + noise)


def thinned(case: Case, share: float, seed: int) -> Case:
    """Lose samples at random, never the first or the last."""
    kept = np.random.default_rng(seed).random(len(case.t)) >= share
    kept[[0, -1]] = True
    return replace(case, t=case.t[kept], states=case.states[kept], delta=case.delta[kept])


def score(theta: FloatArray, case: Case, *, fixed: bool = False) -> FloatArray:
    """Free-running errors of u, v, r against the truth, (3,)."""
    truth = case.truth
    found = errors(theta, truth.t, truth.states, truth.delta, case.speed, fixed=fixed)[0]
    return np.nan_to_num(found, nan=np.inf, posinf=np.inf)


def fitness(found: FloatArray, length: float = 7.0) -> FloatArray:
    """Sum up as u + v + L r; infinite where a run diverged."""
    total = np.nan_to_num(found @ [1.0, 1.0, length], nan=np.inf, posinf=np.inf)
    return np.asarray(total)


def fitness_of_roots(found: FloatArray, length: float) -> FloatArray:
    """Fitness as table 8 has it: sum of the roots of u, v and L r."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(found * [1.0, 1.0, length]).sum(axis=-1))


def fit(
    designs: tuple[FloatArray, ...], targets: FloatArray, name: str, options: Mapping[str, Any]
) -> FloatArray:
    """Fit the three equations, each followed by its bias, (46,)."""
    parts = []
    for design, target in zip(designs, targets.T, strict=True):
        found = ESTIMATORS[name].fit(design, target, **options)
        parts.append(np.append(found.theta, found.bias))
    return np.concatenate(parts)


def without_bias(theta: FloatArray) -> FloatArray:
    """Eq. 14: what is left of a fit when its bias is thrown away.

    With U fixed the column U² is the bias over again: that of table 4 is zero (9.8e-15).
    """
    kept = theta.copy()
    ends = np.cumsum([size + 1 for size in SIZES]) - 1
    kept[[*ends, ends[0] + 2, ends[1] + 2]] = 0.0
    return kept


def differences(
    case: Case, *, nominal: bool, fixed: bool = False
) -> tuple[tuple[FloatArray, ...], FloatArray]:
    """Eq. 22: forward differences, by the true time between samples or by the nominal one."""
    step = STEP if nominal else np.diff(case.t)[:, None]
    designs = regressors(case.states[:-1], case.delta[:-1], case.speed, fixed=fixed)
    return designs, np.diff(case.states, axis=0) / step


def lssvm_printed(options: Mapping[str, Any] = QUICK) -> Callable[[Case, int], FloatArray]:
    """LSSVM as the paper seems to use it: U fixed, nominal steps, and the bias dropped."""
    return lambda case, seed: without_bias(
        fit(*differences(case, nominal=True, fixed=True), "lssvm", options)
    )


def lssvm(case: Case, seed: int) -> FloatArray:
    """Fit the same LSSVM with U(t), the true time stamps, and its bias."""
    return fit(*differences(case, nominal=False), "lssvm", QUICK)


def observed(
    case: Case, bandwidths: FloatArray, designs: tuple[FloatArray, ...], options: Mapping[str, Any] = QUICK
) -> FloatArray:
    """Fit on the accelerations that three observers see, regressors as measured (eq. 19-28)."""
    targets = [
        observe(Observer(float(w)), case.t, x)[:, 1] for w, x in zip(bandwidths, case.states.T, strict=True)
    ]
    return fit(designs, np.column_stack(targets), "eso_lssvm", {**options, "C_b": 1.0})


def searched(
    optimiser: str, options: Mapping[str, Any] = QUICK, *, fixed: bool = False
) -> Callable[[Case, int], FloatArray]:
    """ESO-LSSVM with the bandwidths found by an optimiser on the free-running error (3.2)."""

    def method(case: Case, seed: int) -> FloatArray:
        designs = regressors(case.states, case.delta, case.speed, fixed=fixed)

        def objective(population: FloatArray) -> FloatArray:
            thetas = np.array([observed(case, w, designs, options) for w in population])
            found = errors(thetas, case.t, case.states, case.delta, case.speed, fixed=fixed)
            return fitness(found, case.length)

        search = {"population": 4, "attenuation": 0.9}
        found = minimise(OPTIMISERS[optimiser], objective, [case.bandwidths] * 3, BUDGET, seed, **search)
        if not np.isfinite(found.value):  # every candidate's free run diverged
            return np.full(sum(SIZES) + len(SIZES), np.nan)
        return observed(case, found.x, designs, options)

    return method


def in_degrees(method: Callable[[Case, int], FloatArray]) -> Callable[[Case, int], FloatArray]:
    """The same with the rudder in degrees, as table 4 shows that the paper had it."""

    def converted(case: Case, seed: int) -> FloatArray:
        truth = replace(case.truth, delta=np.degrees(case.truth.delta))
        return method(replace(case, delta=np.degrees(case.delta), truth=truth), seed)

    return converted


def filtered(case: Case, seed: int) -> FloatArray:
    """See accelerations and regressors through one observer, nothing searched: both lag alike.

    Its bandwidth is 1 rad/s for the tanker and goes as speed over length.
    """
    observer = Observer(case.quickness)
    targets = observe(observer, case.t, case.states)[:, 1, :]
    designs = tuple(filter_like(observer, case.t, d) for d in regressors(case.states, case.delta, case.speed))
    return fit(designs, targets, "eso_lssvm", {**QUICK, "C_b": 0.0})


def record_of(case: Case, t: FloatArray, states: FloatArray, delta: FloatArray) -> Record:
    """States as the library takes them, the heading integrated from the measured yaw rate."""
    psi = cumulative_trapezoid(states[:, 2], t, initial=0.0)
    return Record(t, states, psi, {"rudder": delta, "n": np.full(len(t), 10.0)})


def automatic(model: str) -> Callable[[Case, int], FloatArray]:
    """Errors (3,) of the library's own way, whole."""

    def method(case: Case, seed: int) -> FloatArray:
        vessel = Vessel("ship", length=case.length, beam=0.2 * case.length)
        sensed = Sensed(vessel, 0.01, 0.001, 0.001, smoothing=1.0)
        trial = trial_of("zigzag", record_of(case, case.t, case.states, case.delta), sensed)
        truth = record_of(case, case.truth.t, case.truth.states, case.truth.delta)
        with np.errstate(over="ignore", invalid="ignore"):
            run = free_run(identify([trial], model, seed=seed), truth, sensed)
            return np.nan_to_num(np.mean((run - truth.states) ** 2, axis=0), nan=np.inf, posinf=np.inf)

    return method


def scored(
    method: Callable[[Case, int], FloatArray], *, fixed: bool = False
) -> Callable[[Case, int], FloatArray]:
    """Errors (3,) of a method that gives the coefficients of the paper's model."""
    return lambda case, seed: score(method(case, seed), case, fixed=fixed)


@dataclass(frozen=True)
class Method:
    """Errors (3,) of the free run from a case and a seed; ``random`` where the seed alone matters."""

    errors: Callable[[Case, int], FloatArray]
    random: bool = False


#: What table 4 tells of the paper's setting: U fixed, the rudder in degrees, columns as they come; C is not printed.
AS_PRINTED: Mapping[str, Any] = {"C": 1e2, "covariance": "none", "scaled": False}


def as_printed(optimiser: str, options: Mapping[str, Any] = AS_PRINTED) -> Callable[[Case, int], FloatArray]:
    """Errors (3,) of the paper's search in the paper's setting."""
    return in_degrees(scored(searched(optimiser, options, fixed=True), fixed=True))


METHODS: Mapping[str, Method] = {
    "LSSVM as printed": Method(scored(lssvm_printed(), fixed=True)),
    "LSSVM, b and stamps kept": Method(scored(lssvm)),
    "BEL as printed": Method(as_printed("bsas"), random=True),
    "ABEL as printed": Method(as_printed("absas"), random=True),
    "BEL, U(t)": Method(scored(searched("bsas")), random=True),
    "ABEL, U(t)": Method(scored(searched("absas")), random=True),
    "one filter on both sides": Method(scored(filtered)),
    "auto": Method(automatic("abkowitz")),
}
#: With the library's choice of the model as well.
ALL_METHODS: Mapping[str, Method] = {**METHODS, "auto, model too": Method(automatic("auto"))}

Printed = Mapping[str, tuple[float, float, float]]


def show(
    title: str,
    make: Callable[[int], Case],
    printed: Printed,
    seeds: int,
    total: Callable[[FloatArray, float], FloatArray] = fitness,
    methods: Mapping[str, Method] = METHODS,
) -> None:
    """Print one column of a table: medians over the seeds, and the spread of the fitness."""
    cases = [make(s) for s in range(seeds)]
    length = cases[0].length
    print(f"\n{title}\n{'':28}{'MSE u':>10}{'MSE v':>10}{'MSE r':>10}{'fitness':>10}{'spread':>20}")
    for name, values in printed.items():
        whole = float(total(np.array(values), length))
        print(f"{'paper: ' + name:28}{''.join(f'{x:>10.2e}' for x in (*values, whole))}")
    abel = float(total(np.array(printed["ABEL"]), length))
    for name, method in methods.items():
        used = cases if cases[0].noisy or method.random else cases[:1]
        found = np.array([method.errors(c, s) for s, c in enumerate(used)])
        sums = np.nan_to_num(total(found, length), nan=np.inf, posinf=np.inf)
        middle = (*np.median(found, axis=0), np.median(sums))
        spread = f"{sums.min():.1e}..{sums.max():.1e}" if len(used) > 1 else ""
        ratio = f"  ABEL's / {abel / middle[3]:.0f}" if middle[3] < abel else ""
        print(f"{name:28}{''.join(f'{x:>10.2e}' for x in middle)}{spread:>20}{ratio}", flush=True)
