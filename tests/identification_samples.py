"""Trials straight from the truth simulator, without files: what the identification core is tested on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from fixtures.campaign import record_campaign
from fixtures.effects import World
from fixtures.sensors import Suite
from fixtures.vessels import make_vessel
from identify.structure import structure_for
from preprocess.trial import Measurement, Trial
from preprocess.vessel import Input, Vessel

RUDDER = Input("rudder", "rudder", position=(-0.5, 0.0))
PROPELLER = Input("n", "propeller", position=(-0.5, 0.0))
MOTORS = (
    Input("left", "thruster", position=(-0.35, -0.3)),
    Input("right", "thruster", position=(-0.35, 0.3)),
)
BOAT = Vessel(
    "boat", length=1.2, beam=0.5, draught=0.1, mass=25.0,
    propeller={"diameter": 0.06, "k0": 0.29, "k1": -0.28, "k2": -0.14}, rudder={"area": 0.004, "height": 0.08},
)  # fmt: skip


def structure_of(model, inputs=(RUDDER, PROPELLER), **options):
    given = {"logs": ("a", "b"), "streams": ("position", "heading", "yaw_rate"), "u0": 0.5} | options
    return structure_for(model, BOAT, inputs, **given)[0]


def inputs_of(vessel):
    return tuple(
        Input(a.name, a.kind, law=a.law, position=a.position, drives=a.drives) for a in vessel.actuators
    )


def trials_of(name, manoeuvres, duration, seed, effects=(), validate=1, suite=None):
    """Trials of a fixtures vessel whose smoothed states are the truth with a little noise."""
    vessel, suite = make_vessel(name), suite or Suite()
    runs = record_campaign(
        vessel, World(tuple(effects)), suite, manoeuvres, duration=duration, seed=seed, validate=validate
    )
    return vessel, tuple(_trial(vessel, run, suite, seed) for run in runs)


def _trial(vessel, run, suite, seed):
    truth, streams = run.recording.truth, run.recording.streams
    t = truth.t[:: round(0.1 / (truth.t[1] - truth.t[0]))]
    rng = np.random.default_rng([seed, len(run.name)])
    states = {"t": t}
    for column, noise in {"x": 0.01, "y": 0.01, "psi": 0.002, "u": 0.01, "v": 0.01, "r": 0.002}.items():
        states[column] = np.interp(t, truth.t, getattr(truth, column)) + noise * rng.standard_normal(len(t))
        states[f"sigma_{column}"] = np.full(len(t), noise)
    sensors = {"position": (suite.position, ("north", "east")), "heading": (suite.heading, ("value",)),
               "yaw_rate": (suite.yaw_rate, ("value",))}  # fmt: skip
    if suite.velocity:
        sensors["velocity"] = suite.velocity, ("north", "east")
    measurements = {
        n: _measurement(n, streams[n], names, s.noise, 1.0 / s.rate) for n, (s, names) in sensors.items()
    }
    logged = streams["inputs"]
    inputs = {n: _measurement(n, logged, (n,), 0.0, 1.0 / suite.input_rate, held=True) for n in vessel.names}
    declared = Vessel(vessel.name, vessel.length, vessel.beam, antenna=vessel.antenna)
    return Trial(
        run.name, run.role, declared, inputs_of(vessel), measurements, inputs, pd.DataFrame(states),
        ((float(t[0]), float(t[-1])),), truth.start,
    )  # fmt: skip


def _measurement(name, stream, columns, sigma, interval, held=False):
    value = np.column_stack([stream.columns[c] for c in columns])
    value = value[:, 0] if len(columns) == 1 else value
    return Measurement(name, stream.t, value, sigma, stream.good, sample_time=interval, held=held)


def with_nothing_between(stretches):
    """Stretches whose inputs are said to be logged so often that nothing is hidden between two samples."""
    return tuple(
        replace(s, inputs={k: replace(m, sample_time=0.01) for k, m in s.inputs.items()}) for s in stretches
    )


def modulus_truth(vessel):
    """Coefficients of the ``modulus`` model of a vessel with thrusters alone, by (equation, term)."""
    h, gain = vessel.hull, vessel.actuators[0].gain
    return {
        ("u", "u"): h.X_u / h.m11, ("u", "u|u|"): h.X_uu / h.m11, ("u", "vr"): (h.X_vr + h.m22) / h.m11,
        ("u", "r²"): h.X_rr / h.m11, ("u", "T:thruster"): gain / h.m11,
        ("v", "v"): h.Y_v / h.m22, ("v", "v|v|"): h.Y_vv / h.m22, ("v", "r"): h.Y_r / h.m22,
        ("v", "ur"): (h.Y_ur - h.m11) / h.m22,
        ("r", "r"): h.N_r / h.m33, ("r", "r|r|"): h.N_rr / h.m33, ("r", "v"): h.N_v / h.m33,
        ("r", "uv"): (h.N_uv + h.m11 - h.m22) / h.m33, ("r", "N:thruster"): gain / h.m33,
    }  # fmt: skip
