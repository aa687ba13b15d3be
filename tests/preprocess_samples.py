"""Logs for the tests of preprocessing: a simulated truth, sampled by imperfect sensors."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import pandas as pd

from fixtures.manoeuvres import make_manoeuvre
from fixtures.simulator import Truth, simulate
from fixtures.vessels import make_vessel
from ingest.log import Log
from preprocess.trial import Trial
from preprocess.vessel import Input, Sensor, Vessel


@dataclass(frozen=True)
class Imperfect:
    """A sensor: Hz, white noise, jitter (share of the interval), shares lost and wild (6-30 σ)."""

    rate: float
    sigma: float
    jitter: float = 0.1
    lost: float = 0.0
    outliers: float = 0.0
    delay: float = 0.0
    rounding: float = 0.0


def truth_of(vessel="usv", manoeuvre="zigzag", duration=120.0, seed=0, heading=0.4) -> Truth:
    ship = make_vessel(vessel)
    return simulate(ship, make_manoeuvre(manoeuvre, ship, duration, seed), seed=seed, heading=heading)


def at(truth: Truth, t, name):
    return np.interp(t, truth.t, getattr(truth, name))


def sample(rng, sensor: Imperfect, duration: float, of) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps, values (n, m) and which are outliers."""
    step = 1.0 / sensor.rate
    t = np.arange(0.0, duration, step)
    t = np.clip(t + rng.uniform(-0.5, 0.5, len(t)) * sensor.jitter * step, 0.0, duration)
    t = np.sort(t[rng.random(len(t)) >= sensor.lost])
    value = np.column_stack(of(t))
    value = value + rng.normal(0.0, sensor.sigma, value.shape)
    bad = rng.random(len(t)) < sensor.outliers
    size = rng.uniform(6.0, 30.0, len(t)) * sensor.sigma
    angle = rng.uniform(0.0, 2.0 * np.pi, len(t))
    push = (
        np.column_stack([np.cos(angle), np.sin(angle)])
        if value.shape[1] == 2
        else np.sign(np.sin(angle))[:, None]
    )
    value[bad] += (push * size[:, None])[bad]
    if sensor.rounding:
        value = np.round(value / sensor.rounding) * sensor.rounding
    return t + sensor.delay, value, bad


def table(t, names, value) -> pd.DataFrame:
    index = pd.Index(np.round(t * 1e9).astype("int64"), name="t_ns")
    return pd.DataFrame(dict(zip(names, value.T, strict=True)), index=index)


@dataclass(frozen=True)
class Sampled:
    truth: Truth
    log: Log
    bad: dict[str, np.ndarray]
    sensors: dict[str, Sensor]
    inputs: list[Input]
    vessel: Vessel


def sampled(truth: Truth, seed=0, antenna=(0.0, 0.0), **sensors: Imperfect) -> Sampled:
    """A log of ``position``, ``heading``, ``yaw_rate``, ``velocity`` as given, and the inputs at 10 Hz."""
    rng, end = np.random.default_rng(seed), float(truth.t[-1])
    cos, sin = lambda t: np.cos(at(truth, t, "psi")), lambda t: np.sin(at(truth, t, "psi"))

    def north(t):
        return at(truth, t, "u") * cos(t) - at(truth, t, "v") * sin(t)

    def east(t):
        return at(truth, t, "u") * sin(t) + at(truth, t, "v") * cos(t)

    a, b = antenna
    of = {
        "position": lambda t: (
            at(truth, t, "x") + a * cos(t) - b * sin(t),
            at(truth, t, "y") + a * sin(t) + b * cos(t),
        ),
        "heading": lambda t: (at(truth, t, "psi"),),
        "yaw_rate": lambda t: (at(truth, t, "r"),),
        "velocity": lambda t: (
            north(t) - at(truth, t, "r") * (a * sin(t) + b * cos(t)),
            east(t) + at(truth, t, "r") * (a * cos(t) - b * sin(t)),
        ),
    }
    of["IMU"] = lambda t: body_acceleration(truth, t)
    tables, bad, declared = {}, {}, {}
    for name, sensor in sensors.items():
        t, value, bad[name] = sample(rng, sensor, end, of[name])
        names = ["north", "east"] if value.shape[1] == 2 else ["value"]
        if name == "heading":
            value = np.mod(value, 2.0 * np.pi)
        tables[name] = table(np.maximum(t, 0.0), names, value)
        declared[name] = Sensor(name, {n: f"{name}.{n}" for n in names}, None)
    if "IMU" in tables:
        tables |= inertial(tables.pop("IMU"), truth)
        declared.pop("IMU")
    names = [f"a{k}" for k in range(truth.inputs.shape[1])]
    tables["act"] = table(truth.t[::10], names, truth.inputs[::10])
    inputs = [Input(n, "thruster", f"act.{n}", unit="N") for n in names]
    vessel = Vessel(truth.vessel.name, truth.vessel.length, truth.vessel.beam, antenna=antenna)
    return Sampled(truth, Log(Path("made.csv"), "csv", tables), bad, declared, inputs, vessel)


#: Constant errors of the accelerometer, m/s², forward and starboard.
BIAS = (0.08, -0.05)


def body_acceleration(truth: Truth, t):
    """Acceleration of the origin along the body's axes, (n,) each."""
    du, dv = (np.interp(t, truth.t, np.gradient(getattr(truth, k), truth.t)) for k in "uv")
    return du - at(truth, t, "r") * at(truth, t, "v"), dv + at(truth, t, "r") * at(truth, t, "u")


def tilt(t):
    """Roll and pitch of a boat in light waves, rad."""
    return 0.05 * np.sin(1.9 * t) + 0.02, 0.02 * np.sin(1.3 * t)


def inertial(rows: pd.DataFrame, truth: Truth) -> dict[str, pd.DataFrame]:
    """Specific force of a rolling boat, with roll and pitch, as an autopilot logs them."""
    t = rows.index.to_numpy() * 1e-9
    (roll, pitch), (forward, starboard), g = tilt(t), (rows.to_numpy() + BIAS).T, 9.80665
    # level axes to the body's: pitch first, then roll; gravity is felt as -g downwards
    x, down = forward * np.cos(pitch) + g * np.sin(pitch), forward * np.sin(pitch) - g * np.cos(pitch)
    y, z = starboard * np.cos(roll) + down * np.sin(roll), -starboard * np.sin(roll) + down * np.cos(roll)
    attitude = np.degrees(np.column_stack(tilt(t)))
    return {
        "IMU": table(t, ("AccX", "AccY", "AccZ"), np.column_stack([x, y, z])),
        "ATT": table(t, ("Roll", "Pitch"), attitude),
    }


def assert_same_trial(one: Trial, other: Trial) -> None:
    """Two trials alike to the last bit, in every field."""
    pd.testing.assert_frame_equal(one.states, other.states.reset_index(drop=True), check_exact=True)
    for kind in ("measurements", "inputs"):
        mine, theirs = getattr(one, kind), getattr(other, kind)
        assert list(mine) == list(theirs)
        for k, m in mine.items():
            for part in ("t", "value", "good", "weight"):
                a, b = getattr(m, part), getattr(theirs[k], part)
                assert (a is None) == (b is None), (k, part)
                if a is not None:
                    np.testing.assert_array_equal(a, b)
            bare = [replace(x, t=0, value=0, good=0, weight=0) for x in (m, theirs[k])]
            assert bare[0] == bare[1]
    for field in fields(Trial):
        if field.name not in ("states", "measurements", "inputs"):
            assert getattr(one, field.name) == getattr(other, field.name), field.name
