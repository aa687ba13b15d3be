"""The beginning: the first minute goes through the same preprocessing and the same fit as a log would.

What comes of it: the noise of the sensors, how the inputs are to be read, and a first model with its uncertainty.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import optimize

from identify.base_fit import fit_from_scratch, window_length
from identify.choose_model import choose_model
from identify.fitted import Fitted
from identify.held_inputs import prepare_best
from identify.online.knowledge import Noise
from identify.output_error import Prior
from identify.stretch import STREAMS
from identify.structure import Structure
from ingest.log import Log
from preprocess import kalman
from preprocess.causal import CausalLevels
from preprocess.chains import Stream, assemble, variances
from preprocess.raw import Raw
from preprocess.rounding import resolution
from preprocess.run_of_log import LoggedRun
from preprocess.trial import FloatArray, Trial
from preprocess.trials import Gathered, make_trial
from seatrial.campaign.data import Campaign
from seatrial.online.stream_buffer import InputTraits

#: The first fit is made of so many windows of the estimate.
WINDOWS = 1.5


@dataclass(frozen=True)
class Beginning:
    """Where the on-line identification sets out from.

    Attributes
    ----------
    structure : Structure
    prior : Prior
    p : (np,)
    noise : Noise
    levels : CausalLevels
    traits : mapping of str to InputTraits
    quantum : (4,)
        Steps to which the sensors' values are rounded.
    notes : tuple of str
    """

    structure: Structure
    prior: Prior
    p: FloatArray
    noise: Noise
    levels: CausalLevels
    traits: Mapping[str, InputTraits]
    quantum: FloatArray
    notes: tuple[str, ...] = ()


def window_of(length: float, h: float) -> float:
    """Length of the estimate's windows for a vessel, a whole number of steps, s."""
    return h * round(window_length(length) / h)


def needed_seconds(length: float) -> float:
    """How much is collected before the first fit, s."""
    return WINDOWS * window_length(length)


def begin(
    campaign: Campaign, collected: Mapping[str, Sequence[Raw]], origin: tuple[float, float] | None
) -> Beginning:
    """The first fit.

    Parameters
    ----------
    campaign : Campaign
    collected : mapping of str to sequence of Raw
        Samples of every quantity and input so far.
    origin : (latitude, longitude), optional
        Degrees.

    Raises
    ------
    DataError
        There is not yet enough in them.
    """
    trial = trial_of(campaign, collected, origin)
    model = choose_model([trial])[0] if campaign.model == "auto" else campaign.model
    prepared = prepare_best([trial], model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    traits = {k: InputTraits(m.sigma, m.sample_time, m.held) for k, m in prepared.identify[0].inputs.items()}
    setting = replace(prepared.structure.setting, logs=("live",), identify_logs=("live",))
    structure = replace(prepared.structure, setting=setting)
    return Beginning(
        structure, fitted.prior, fitted.solution.p, noise_of(fitted), levels_of(trial), traits,
        quantum_of(collected), prepared.notes,
    )  # fmt: skip


def trial_of(
    campaign: Campaign, collected: Mapping[str, Sequence[Raw]], origin: tuple[float, float] | None
) -> Trial:
    """All samples so far as a trial, smoothed off line."""
    whole = {k: in_one(v) for k, v in collected.items()}
    names = {i.name for i in campaign.inputs}
    run = LoggedRun("live", Log(Path("live"), "live", {}), "identify")
    sensors = {k: r for k, r in whole.items() if k not in names}
    gathered = Gathered(run, sensors, {n: whole[n] for n in names}, ())
    ordered = Gathered(run, sensors, {i.name: gathered.inputs[i.name] for i in campaign.inputs}, ())
    return make_trial(ordered, campaign.vessel, campaign.inputs, "identify", (-np.inf, np.inf), origin, None)


def in_one(parts: Sequence[Raw]) -> Raw:
    """Samples of one sensor, joined in the order of time."""
    t = np.concatenate([p.t for p in parts])
    order = np.argsort(t, kind="stable")
    order = order[np.r_[True, np.diff(t[order]) > 0]]
    value, flagged = (np.concatenate([getattr(p, k) for p in parts])[order] for k in ("value", "flagged"))
    quantum = float(np.median([p.quantum for p in parts]))
    return replace(parts[0], t=t[order], value=value, flagged=flagged, quantum=quantum)


def quantum_of(collected: Mapping[str, Sequence[Raw]]) -> FloatArray:
    """Steps to which the values of position, heading, yaw rate and velocity are rounded; 0 where none shows."""
    whole = {s: in_one(collected[s]) for s in STREAMS if s in collected}
    return np.array([(r.quantum or resolution(r.value)) if (r := whole.get(s)) else 0.0 for s in STREAMS])


def noise_of(fitted: Fitted) -> Noise:
    """Noise of the streams as the fit's errors show it."""
    problem = fitted.problem
    kinds, sigmas = (
        np.concatenate([getattr(s.samples, k) for s in problem.stretches]) for k in ("kind", "sigma")
    )
    sigma = [float(np.median(sigmas[kinds == k])) if (kinds == k).any() else 1.0 for k in range(4)]
    return Noise(np.array(sigma), problem.inflation, problem.dispersion)


def levels_of(trial: Trial) -> CausalLevels:
    """Levels of the causal observer: the sensors' noise, and the process noise that makes its errors most likely."""
    sigma = [trial.measurements[s].sigma if s in trial.measurements else np.nan for s in STREAMS]
    states = trial.states.dropna(subset=["u", "r"])
    speed = float(np.sqrt(np.mean(states["u"] ** 2 + states["v"] ** 2)))
    turn = float(np.sqrt(np.mean(states["r"] ** 2)))
    rate = (max(2.0 * turn, 0.05), max(2.0 * speed, 0.2))
    return CausalLevels(
        _intensity(trial, ("heading", "yaw_rate"), rate[0]), _intensity(trial, ("position", "velocity"), rate[1]),
        (sigma[0], sigma[1], sigma[2], sigma[3]), rate, trial.vessel.antenna,
    )  # fmt: skip


def _intensity(trial: Trial, names: tuple[str, str], rate: float) -> float:
    """Process intensity of a chain by maximum likelihood, the sensors' noise given."""
    streams = []
    for order, name in enumerate(names):
        m = trial.measurements.get(name)
        if m is not None:
            value = m.value if m.value.ndim == 2 else m.value[:, None]
            streams.append(Stream(name, m.t, value, order, m.good, m.good))
    made = assemble(tuple(streams), trial.segments, np.empty(0))
    sigma = np.array([max(trial.measurements[s.name].sigma, 1e-9) for s in streams])
    rows = replace(made.rows, variance=variances(made.stream, sigma))
    prior = np.array([1e8, 100.0, 100.0]) * rate**2
    found = optimize.minimize_scalar(
        lambda x: kalman.cost(rows, float(np.exp(x)), prior),
        bounds=(np.log(rate**2) - 18.0, np.log(rate**2) + 10.0), method="bounded", options={"xatol": 0.05},
    )  # fmt: skip
    return float(np.exp(found.x))
