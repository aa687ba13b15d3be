"""Moreno-Salinas et al. 2013: standard deviations of the prediction errors of the Blanke model, and its coefficients.

    python -m benchmarks.papers.p4_deviations [--seeds 5] [--quick]

The measured data are not published: the model of eq. 16 itself stands for the ship, so that what is measured is how
much of it the paper's experiment gives back. Its two constants 0.0600 and 0.06 are one column, of which only the sum
can be identified; 1.934 m/s is the speed at which they balance. Training on a 20/20 zigzag of 90 s at 0.2 s, validation
on turns of 20 degrees to both sides (240 s) and a 10/10 zigzag (90 s). Noise as the paper's sensors: 0.04 m/s, and
0.05 deg of heading, which as a rate is taken as 0.002 rad/s beside it. γ = 1e4 as printed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from benchmarks.papers.library import RUDDER, Identified, Sensed, free_run, identify, trial_of
from benchmarks.papers.record import Record, run, steps, zigzag
from benchmarks.papers.report import command_line, row, spread
from identify.by_optimiser import with_states
from identify.estimators import ESTIMATORS
from identify.estimators.estimate import FloatArray
from identify.output_error import Stopped
from identify.prepare import prepare
from identify.structure import null_parameters
from preprocess.eso import Observer, filter_like, observe
from preprocess.vessel import Vessel

STEP, SPEED, GAMMA = 0.2, 1.934, 1e4
NOISE = (0.04, 0.04, 0.002)
#: Noise of the compass, rad.
HEADING = float(np.radians(0.05))
SENSED = Sensed(Vessel("scale ship", 4.389, 0.838), 0.04, 0.002, HEADING, smoothing=2.0, inputs=(RUDDER,))
TERMS = {
    "u": {"|u|u": -0.0321, "vr": -2.7053, "δ²": -0.2257, "1": 0.12},
    "v": {"ur": -0.4531, "uv": -0.5284, "|v|v": 0.5354, "|v|r": -0.4121, "δ": 0.0520, "1": 0.0007},
    "r": {"ur": -1.1699, "uv": -0.6696, "|v|v": 2.3001, "|v|r": 3.9335, "δ": -0.5503, "1": -0.0054},
}
PRINTED = {
    "zigzag 20/20": (0.0486, 0.0171, 0.0066),
    "turn -20": (0.1786, 0.0303, 0.0160),
    "turn +20": (0.04, 0.0236, 0.0129),
    "zigzag 10/10": (0.0466, 0.0239, 0.0097),
}
Method = Callable[[Record, int], Identified]


def _plant(u: float, v: float, r: float, delta: float, n: float) -> tuple[float, float, float]:
    values = {
        "|u|u": abs(u) * u, "vr": v * r, "δ²": delta * delta, "1": 1.0, "ur": u * r, "uv": u * v,
        "|v|v": abs(v) * v, "|v|r": abs(v) * r, "δ": delta,
    }  # fmt: skip
    x, y, z = (sum(c * values[name] for name, c in TERMS[dof].items()) for dof in "uvr")
    return x, y, z


def runs(share: float = 1.0) -> dict[str, Record]:
    """The four manoeuvres of section 4."""
    rates = (float(np.radians(20.0)), 1.0)

    def turn(degrees: float) -> Record:
        helm = steps(np.array([0.0]), np.radians([degrees]), np.ones(1))
        return run(_plant, helm, share * 240.0, step=STEP, speed=SPEED, rates=rates)

    def zig(degrees: float) -> Record:
        return run(_plant, zigzag(degrees, degrees, 1.0), 90.0, step=STEP, speed=SPEED, rates=rates)

    return dict(zip(PRINTED, (zig(20.0), turn(-20.0), turn(20.0), zig(10.0)), strict=True))


def columns(record: Record) -> dict[str, FloatArray]:
    """Every regressor of eq. 12 at every sample, but for the constant."""
    (u, v, r), d = record.states.T, record.inputs["rudder"]
    return {
        "|u|u": np.abs(u) * u, "vr": v * r, "r²": r * r, "δ²": d * d, "ur": u * r, "uv": u * v,
        "|v|v": np.abs(v) * v, "|v|r": np.abs(v) * r, "δ": d,
    }  # fmt: skip


def _assembled(record: Record, fit: Callable[[FloatArray, int], tuple[FloatArray, float]]) -> Identified:
    """A fit of each equation, from its columns and its number, as a model of the library."""
    prepared = prepare([trial_of("zigzag", record, SENSED)], "blanke")
    p, made = null_parameters(prepared.structure), columns(record)
    for equation, dof in enumerate("uvr"):
        mine = {
            s.term.text: k
            for k, s in enumerate(prepared.structure.slots)
            if s.term is not None and s.term.dof == dof
        }
        names = [name for name in mine if name not in ("1", "r²")]  # the paper sets the term in r² to zero
        theta, bias = fit(np.column_stack([made[name] for name in names]), equation)
        p[[mine[name] for name in names]] = theta
        p[mine["1"]] = bias
    return Identified(prepared, with_states(prepared, p, Stopped.SOLVED))


def as_printed(record: Record, seed: int) -> Identified:
    """Eq. 11-15: x(k + 1) regressed on x(k), whose coefficient is left free, and on the rest and a column of ones."""

    def fit(design: FloatArray, equation: int) -> tuple[FloatArray, float]:
        x = record.states[:, equation]
        whole = np.column_stack([x, design, np.ones(len(x))])[:-1]
        found = ESTIMATORS["lssvm"].fit(whole, x[1:], C=GAMMA, scaled=False, covariance="none")
        return found.theta[1:-1] / STEP, (float(found.theta[-1]) + found.bias) / STEP

    return _assembled(record, fit)


def on_differences(record: Record, seed: int) -> Identified:
    """The same with the coefficient of x(k) known: it is 1."""

    def fit(design: FloatArray, equation: int) -> tuple[FloatArray, float]:
        rates = np.diff(record.states[:, equation]) / STEP
        found = ESTIMATORS["lssvm"].fit(design[:-1], rates, C=GAMMA, scaled=False, covariance="none")
        return found.theta, found.bias

    return _assembled(record, fit)


def one_filter(record: Record, seed: int) -> Identified:
    """The same regression with both sides through one observer of 1 rad/s, and the coefficient of x(k) known."""
    observer = Observer(1.0)

    def fit(design: FloatArray, equation: int) -> tuple[FloatArray, float]:
        target = observe(observer, record.t, record.states[:, equation])[:, 1]
        found = ESTIMATORS["lssvm"].fit(
            filter_like(observer, record.t, design), target, C=1e6, covariance="none"
        )
        return found.theta, found.bias

    return _assembled(record, fit)


def measured(truth: Record, seed: int) -> Record:
    """A record with the noise of the sensors, the compass's on the heading."""
    random = np.random.default_rng([seed, len(truth.t)])
    return replace(truth.noisy(NOISE, seed), psi=truth.psi + HEADING * random.standard_normal(len(truth.psi)))


def output_error(record: Record, seed: int) -> Identified:
    """The library's default on the same model, from motion smoothed as much as its noise asks for."""
    bent = np.diff(record.states[:, 0], 2)  # white noise of size s has second differences of size s √6
    noisy = float(np.median(np.abs(bent))) > 0.1 * NOISE[0]
    sensed = SENSED if noisy else replace(SENSED, smoothing=0.0)
    return identify([trial_of("zigzag", record, sensed)], "blanke")


METHODS: Mapping[str, Method] = {
    "LS-SVM as printed": as_printed,
    "LS-SVM on differences": on_differences,
    "one filter on both sides": one_filter,
    "output error": output_error,
}


def main() -> None:
    chosen = command_line(__doc__)
    made = runs(0.25 if chosen.quick else 1.0)
    training = made["zigzag 20/20"]
    for noise in (False, True):
        print(
            f"\n{'noise of the sensors' if noise else 'no noise'}; standard deviation of the free run's error"
        )
        seen = [measured(training, s) if noise else training for s in range(chosen.seeds if noise else 1)]
        fits = {name: [method(s, k) for k, s in enumerate(seen)] for name, method in METHODS.items()}
        for title, record in made.items():
            row(title, ["u m/s", "v m/s", "r rad/s"], 32, 28)
            row("paper (measured ship)", [f"{x:.4f}" for x in PRINTED[title]], 32, 28)
            for name, found in fits.items():
                errors = np.array(
                    [np.std(free_run(f, record, SENSED) - record.states, axis=0) for f in found]
                )
                row(name, [spread(np.nan_to_num(c, nan=np.inf), ".4f") for c in errors.T], 32, 28)


if __name__ == "__main__":
    main()
