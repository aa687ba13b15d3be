"""The library's own way from a record to a model and to its free run: what `seatrial run` does, without files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.signal import savgol_filter

from benchmarks.papers.record import Record
from identify import kernel
from identify.choose_model import choose_model
from identify.drive import drive
from identify.estimators.estimate import FloatArray
from identify.fit import Fit
from identify.fit_with import fit_as_a_run_ends
from identify.fitted import Fitted
from identify.predict import run as run_model
from identify.prepare import Prepared, prepare
from identify.report_fit import make_fit
from identify.stretch import stretches_of
from preprocess.trial import Measurement, Trial
from preprocess.vessel import Input, Vessel

RUDDER = Input("rudder", "rudder", position=(-0.5, 0.0))
PROPELLER = Input("n", "propeller", position=(-0.5, 0.0))


@dataclass(frozen=True)
class Sensed:
    """How a record is measured: the vessel, the noise of u and v, of r and of the heading, and a time to smooth over.

    ``smoothing`` in s makes the motion that a search begins from, and that a fit far from the noise is compared with.
    """

    vessel: Vessel
    velocity: float
    yaw_rate: float
    heading: float
    smoothing: float = 1.0
    inputs: tuple[Input, ...] = (RUDDER, PROPELLER)


def trial_of(name: str, record: Record, sensed: Sensed, role: str = "identify") -> Trial:
    """A record as a trial: velocity over ground, yaw rate and heading as sensors, no position."""
    t = record.t
    c, s = np.cos(record.psi), np.sin(record.psi)
    u, v, r = record.states.T
    ground = np.column_stack([u * c - v * s, u * s + v * c])
    measurements = {
        "velocity": _measurement("velocity", t, ground, sensed.velocity),
        "yaw_rate": _measurement("yaw_rate", t, r.copy(), sensed.yaw_rate),
        "heading": _measurement("heading", t, record.psi, sensed.heading),
    }
    inputs = {i.name: _measurement(i.name, t, record.inputs[i.name], 0.0) for i in sensed.inputs}
    return Trial(
        name, role, sensed.vessel, sensed.inputs, measurements, inputs, _smoothed(record, sensed),
        ((float(t[0]), float(t[-1])),),
    )  # fmt: skip


def _measurement(name: str, t: FloatArray, value: FloatArray, sigma: float) -> Measurement:
    step = float(np.median(np.diff(t)))
    return Measurement(name, t, value, sigma, np.ones(len(t), dtype=bool), sample_time=step)


def _smoothed(record: Record, sensed: Sensed) -> pd.DataFrame:
    """States by local parabolas on an even grid."""
    step = float(np.median(np.diff(record.t)))
    grid = np.arange(record.t[0], record.t[-1] + 0.5 * step, step)
    columns = np.column_stack([record.states, record.psi])
    even = np.column_stack([np.interp(grid, record.t, x) for x in columns.T])
    length = 2 * round(sensed.smoothing / step) + 1
    if length > 3:
        even = savgol_filter(even, length, 2, axis=0)
    u, v, r, psi = even.T
    c, s = np.cos(psi), np.sin(psi)
    table = {"t": grid, "x": np.cumsum(u * c - v * s) * step, "y": np.cumsum(u * s + v * c) * step}
    table |= {"psi": psi, "u": u, "v": v, "r": r}
    noise = {"u": sensed.velocity, "v": sensed.velocity, "r": sensed.yaw_rate}
    table |= {f"sigma_{k}": np.full(len(grid), x) for k, x in noise.items()}
    return pd.DataFrame(table)


@dataclass(frozen=True)
class Identified:
    """What was prepared and what came of it."""

    prepared: Prepared
    fitted: Fitted

    @property
    def fit(self) -> Fit:
        """Parameters with standard errors and verdicts."""
        return make_fit(self.prepared, self.fitted, estimator="", optimiser="", seed=0)


def identify(
    trials: Sequence[Trial],
    model: str = "auto",
    estimator: str = "auto",
    optimiser: str = "auto",
    seed: int = 0,
) -> Identified:
    """Fit as a user would; ``auto`` chooses the model by its prediction of parts left out."""
    name = choose_model(trials, seed)[0] if model == "auto" else model
    prepared = prepare(trials, name)
    return Identified(prepared, fit_as_a_run_ends(prepared, estimator, optimiser, seed))


def free_run(found: Identified, truth: Record, sensed: Sensed) -> FloatArray:
    """Predicted u, v, r (l, 3) at the record's times from its first state and inputs alone; NaN after a run-away."""
    structure, p = found.fitted.solution.structure, found.fitted.solution.p
    trial = trial_of("free run", truth, Sensed(sensed.vessel, 0.0, 0.0, 0.0, 0.0, sensed.inputs), "validate")
    stretch = stretches_of(trial, found.prepared.identify[0].h)[0]
    first = np.zeros(kernel.NX)
    first[2], first[3:6] = truth.psi[0], truth.states[0]
    states = run_model(structure, drive(structure, p, stretch), stretch, first)[:, 3:6]
    return np.column_stack([np.interp(truth.t, stretch.grid, x) for x in states.T])


def r_squared(predicted: FloatArray, truth: FloatArray) -> FloatArray:
    """1 - SSE / SST of each column; -inf where a run left all bounds, NaN where nothing varies."""
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        missed = np.nan_to_num(np.sum((predicted - truth) ** 2, axis=0), nan=np.inf)
        total = np.sum((truth - truth.mean(axis=0)) ** 2, axis=0)
        return np.asarray(np.where(total > 0, 1.0 - missed / total, np.nan), dtype=float)
