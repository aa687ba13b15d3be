# ruff: noqa: ANN001, ANN201, E402
"""The truths that preprocessing is measured on, their sensors, and the errors of a motion against them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1] / "tests")]

from preprocess_samples import Imperfect, Sampled, sampled, truth_of

from preprocess.run_of_log import LoggedRun
from preprocess.trial import Trial
from preprocess.trials import make_trials

#: Vessels and manoeuvres for levels, wanders and clocks.
SAILED = (
    ("usv", "zigzag"),
    ("usv", "random"),
    ("catamaran", "random"),
    ("tanker", "zigzag"),
    ("patrol", "random"),
    ("raft", "random"),
)
CHANNELS = ("u", "v", "r", "du", "dv", "dr")
#: True noise levels of the sensors, SI.
NOISE = {"position": 0.02, "heading": 0.01, "yaw_rate": 0.003, "velocity": 0.05}
#: Vessel, manoeuvre, rates of position, heading and yaw rate (Hz), shares of samples lost and wild.
CASES = (
    ("usv", "zigzag", (5, 10, 20), 0.1, 0.0),
    ("usv", "random", (1, 5, 5), 0.2, 0.0),
    ("usv", "circle", (2, 5, 5), 0.4, 0.02),
    ("catamaran", "random", (5, 10, 10), 0.4, 0.0),
    ("tanker", "zigzag", (5, 10, 20), 0.1, 0.05),
    ("patrol", "random", (10, 20, 20), 0.2, 0.05),
    ("raft", "random", (5, 10, 10), 0.0, 0.05),
    ("cybership", "zigzag", (5, 10, 10), 0.2, 0.05),
    ("tug", "random", (20, 20, 20), 0.4, 0.05),
)


#: Vessel, manoeuvre, rates of position, heading and yaw rate (Hz), white noise of the accelerations, m/s².
INERTIAL = (
    ("catamaran", "random", (5, 10, 10), 0.05),
    ("catamaran", "random", (1, 10, 10), 0.05),
    ("usv", "zigzag", (5, 10, 20), 0.05),
    ("usv", "random", (1, 5, 5), 0.2),
    ("tug", "random", (5, 20, 20), 0.05),
    ("tanker", "zigzag", (5, 10, 20), 0.05),
)


def inertial(vessel, manoeuvre, rates, noise: float, seed: int, keep: bool) -> Sampled:
    """A log with accelerations, roll and pitch; without them the other sensors' samples are the same."""
    names = ("position", "heading", "yaw_rate")
    sensors = {k: Imperfect(r, NOISE[k], 0.2, 0.1) for k, r in zip(names, rates, strict=True)}
    made = sampled(truth_of(vessel, manoeuvre, 120.0, seed), seed, **sensors, IMU=Imperfect(50, noise))
    if not keep:
        for name in ("IMU", "ATT"):
            made.log.tables.pop(name)
    return made


def rates_of(case):
    """Vessel, manoeuvre and case in words."""
    vessel, manoeuvre, rates, lost, wild = case
    return f"{vessel} {manoeuvre}, {'/'.join(map(str, rates))} Hz, lost {lost:.0%}, outliers {wild:.0%}"


def make(case, seed: int) -> Sampled:
    vessel, manoeuvre, rates, lost, outliers = case
    sensors = {
        "position": Imperfect(rates[0], NOISE["position"], 0.2, lost, outliers),
        "heading": Imperfect(rates[1], NOISE["heading"], 0.2, lost, outliers),
        "yaw_rate": Imperfect(rates[2], NOISE["yaw_rate"], 0.2, lost, outliers),
    }
    return sampled(truth_of(vessel, manoeuvre, 120.0, seed), seed, **sensors)


def trial_of(made: Sampled) -> Trial:
    return make_trials([LoggedRun("a", made.log, "identify")], made.vessel, made.inputs, made.sensors)[0]


def samples(trial: Trial, name: str):
    """The good samples of a sensor, so that every method has the same."""
    m = trial.measurements[name]
    return m.t[m.good], m.value[m.good]


def errors(out, truth) -> np.ndarray:
    t = np.asarray(out["t"])
    inside = (t > 5.0) & (t < truth.t[-1] - 2.0)
    rows = []
    for name in CHANNELS:
        of = getattr(truth, name) if len(name) == 1 else np.gradient(getattr(truth, name[1:]), truth.t)
        e = np.asarray(out[name])[inside] - np.interp(t[inside], truth.t, of)
        rows.append(float(np.sqrt(np.nanmean(e**2))))
    return np.array(rows)
