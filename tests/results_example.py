"""A realistic `Results` without the pipeline: a toy boat in a current, fits without and with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from identify.fit import Estimated, Fit, FittedEffect
from ingest.log import Finding, Log
from preprocess.trial import Measurement, Step, Trial
from preprocess.vessel import Input, Vessel
from validate.diagnosis import (
    Candidate,
    ChannelScore,
    Diagnosis,
    LogScore,
    ResidualTest,
    Results,
    Round,
    TakenEffect,
    Validation,
    Verdict,
)

CHANNELS = ("u", "v", "r")
STATES = ("x", "y", "psi", "u", "v", "r")
CURRENT = (0.18, 1.3)
NOISE = {"position": 0.02, "heading": 0.004, "yaw_rate": 0.003}
UTC = 1_760_000_000_000_000_000
COEFFICIENTS = (
    ("u", "X_uu", "|u|u", "1/m", -0.55, 0.01),
    ("u", "X_nn", "|n|n", "m", 0.0035, 0.00006),
    ("v", "Y_v", "v", "1/s", -0.9, 0.05),
    ("v", "Y_ur", "ur", "1", -0.45, 0.03),
    ("v", "Y_d", "δ", "m/s²", -0.08, 0.02),
    ("r", "N_r", "r", "1/s", -1.1, 0.02),
    ("r", "N_v", "v", "1/(m·s)", 0.35, 0.21),
    ("r", "N_d", "δ", "1/s²", 0.55, 0.01),
)

VESSEL = Vessel("Toy tug", length=0.97, beam=0.30, antenna=(0.1, 0.0))
INPUTS = (
    Input("rudder", "rudder", signal="rudder_deg", unit="deg"),
    Input("n", "propeller", signal="n", unit="rev/s"),
)


def rollout(t, delta, n, current=(0.0, 0.0), start=(0.0,) * 6, coefficients=COEFFICIENTS):
    """Euler steps of the toy boat; (n, 6) states over ground."""
    value = {c[1]: c[4] for c in coefficients}
    cn, ce = current[0] * np.cos(current[1]), current[0] * np.sin(current[1])
    out = np.empty((len(t), 6))
    x, y, psi, u, v, r = start
    for k in range(len(t)):
        out[k] = x, y, psi, u, v, r
        h = t[k + 1] - t[k] if k + 1 < len(t) else 0.0
        c, s = np.cos(psi), np.sin(psi)
        ur, vr = u - (c * cn + s * ce), v - (-s * cn + c * ce)
        du = value["X_uu"] * abs(ur) * ur + value["X_nn"] * n[k] * abs(n[k]) + r * v
        dv = value["Y_v"] * vr + value["Y_ur"] * ur * r + value["Y_d"] * delta[k]
        dr = value["N_r"] * r + value["N_v"] * vr + value["N_d"] * delta[k]
        x, y, psi = x + h * (c * u - s * v), y + h * (s * u + c * v), psi + h * r
        u, v, r = u + h * du, v + h * dv, r + h * dr
    return out


def commands(kind, t):
    """Rudder (rad) and shaft speed (rev/s) of a manoeuvre."""
    amplitude = np.deg2rad({"zigzag": 20, "circle": 25, "random": 30}.get(kind, 20))
    period = {"zigzag": 14.0, "circle": 1e9, "random": 9.0}.get(kind, 14.0)
    delta = amplitude * np.sign(np.sin(2 * np.pi * t / period + 0.1))
    return delta, np.where(t < t[-1] / 2, 11.0, 14.0) + 0.0 * t


def make_trial(name, kind, role, duration, rate, seed, utc=UTC, origin=(59.43, 24.75)):
    """One simulated trial with noise, outliers and a gap-free smoothed state."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(duration * rate)) / rate
    delta, n = commands(kind, t)
    lag = pd.Series(delta).ewm(alpha=1 / (0.2 * rate)).mean().to_numpy()
    truth = rollout(t, lag, n, CURRENT, (3.0 * seed, 2.0 * seed, 0.4 * seed, 0.9, 0.0, 0.0))
    every = max(1, int(rate // 5))
    fixes = truth[::every, :2] + rng.normal(0, NOISE["position"], (len(t[::every]), 2))
    good = np.ones(len(fixes), bool)
    bad = rng.choice(len(fixes), max(1, len(fixes) // 80), replace=False)
    fixes[bad] += rng.normal(0, 1.5, (len(bad), 2))
    good[bad] = False
    heading = truth[:, 2] + rng.normal(0, NOISE["heading"], len(t))
    gyro = truth[:, 5] + rng.normal(0, NOISE["yaw_rate"], len(t))
    every_sample = np.ones(len(t), bool)
    states = pd.DataFrame({"t": t} | {s: truth[:, i] for i, s in enumerate(STATES)})
    for s, d in zip("uvr", ("du", "dv", "dr"), strict=True):
        states[d] = np.gradient(states[s], t)
    for s, sigma in (("x", 0.01), ("y", 0.01), ("psi", 0.002), ("u", 0.012), ("v", 0.012), ("r", 0.002)):
        states[s] += 0.3 * sigma * np.sin(3 * t)
        states[f"sigma_{s}"] = sigma
    for d in ("du", "dv", "dr"):
        states[f"sigma_{d}"] = 0.03
    trial = Trial(
        name=name,
        role=role,
        vessel=VESSEL,
        inputs_declared=INPUTS,
        measurements={
            "position": Measurement("position", t[::every], fixes, 0.02, good, "GGA.latitude + GGA.longitude",
                                    {"outlier": len(bad)}, every / rate),
            "heading": Measurement("heading", t, heading, 0.004, every_sample, "HDT.heading", {}, 1 / rate),
            "yaw_rate": Measurement("yaw_rate", t, gyro, 0.003, every_sample, "ROT.rate", {}, 1 / rate),
        },
        inputs={
            "rudder": Measurement("rudder", t, delta, 0.0, every_sample, "RSA.starboard", {}, 1 / rate, True),
            "n": Measurement("n", t, n, 0.0, every_sample, "RPM.speed", {}, 1 / rate, True),
        },
        states=states,
        segments=((0.0, float(t[-1])),),
        start=200.0 * seed,
        utc_ns=None if utc is None else utc + int(200e9) * seed,
        origin=origin,
        manoeuvre=kind,
        findings=("Heading and yaw rate agree to 0.02 s.",),
        history=(Step("outliers", {"quantity": "position", "threshold": 4.0}), Step("smooth", {"order": 3})),
    )  # fmt: skip
    return trial, lag


def prediction_of(trial, lag):
    """The table that goes into predictions/*.parquet."""
    states, inputs = trial.states, trial.inputs
    t = states["t"].to_numpy()
    start = tuple(states[list(STATES)].iloc[0])
    table = pd.DataFrame({"t": t})
    if trial.utc_ns is not None:
        table["utc_ns"] = trial.utc_ns + np.rint(t * 1e9).astype(np.int64)
    table["role"] = trial.role
    table[list(STATES)] = states[list(STATES)]
    for s in STATES:
        table[f"{s}_measured"] = np.nan
    rows = np.searchsorted(t, trial.measurements["position"].t)
    table.loc[rows, ["x_measured", "y_measured"]] = trial.measurements["position"].value
    table["psi_measured"] = trial.measurements["heading"].value
    table["r_measured"] = trial.measurements["yaw_rate"].value
    delta, n = inputs["rudder"].value, inputs["n"].value
    table["rudder"], table["n"] = delta, n
    before = rollout(t, lag, n, (0.0, 0.0), start)
    after = rollout(t, lag, n, (0.178, 1.31), start)
    for i, s in enumerate(STATES):
        table[f"{s}_before"], table[f"{s}_after"] = before[:, i], after[:, i]
    return table


def score(table, suffix):
    """Scores per channel of one or several tables."""
    out = {}
    for c in CHANNELS:
        e, m = (table[c + suffix] - table[c]).to_numpy(), table[c].to_numpy()
        mse = float(np.mean(e**2))
        out[c] = ChannelScore(mse, mse**0.5, 1 - mse / float(m.var()), mse**0.5 / float(m.std()))
    return out


def validation_of(predictions, suffix):
    """Pooled and per log."""
    held = pd.concat([p for p in predictions.values() if p["role"].iloc[0] == "validate"])
    channels = score(held, suffix)
    miss = np.hypot(held["x" + suffix] - held["x"], held["y" + suffix] - held["y"])
    turn = held["psi" + suffix] - held["psi"]
    logs = tuple(LogScore(k, p["role"].iloc[0], score(p, suffix)) for k, p in predictions.items())
    fitness = sum(c.mse for c in channels.values())
    return Validation(
        channels, fitness, float(np.sqrt((miss**2).mean())), float(np.sqrt((turn**2).mean())), logs
    )


def make_fit(effects=(), seed=0):
    """The toy's fit; its covariance has some correlation in it."""
    coefficients = tuple(
        Estimated(dof, name, value, stderr, unit, identifiable=name != "N_v", term=term,
                  reason="the data give it only to 60 %" if name == "N_v" else "")
        for dof, name, term, unit, value, stderr in COEFFICIENTS
    )  # fmt: skip
    sd = np.array([e.stderr for e in coefficients] + [p.stderr for e in effects for p in e.parameters])
    root = np.random.default_rng(3).normal(size=(len(sd), 3))
    corr = root @ root.T + np.eye(len(sd))
    corr /= np.sqrt(np.outer(np.diag(corr), np.diag(corr)))
    return Fit(
        model="blanke",
        vessel=VESSEL,
        inputs=INPUTS,
        estimator="output_error",
        optimiser="multistart",
        seed=seed,
        coefficients=coefficients,
        effects=tuple(effects),
        covariance=corr * np.outer(sd, sd),
        chi2_per_dof=1.02 if effects else 6.3,
        stopped="The gain of a further step fell below 1e-6.",
        digest="5f" * 32,
        notes=("The columns |n|n and 1 are collinear at constant shaft speed and were merged.",),
    )


def make_diagnosis(fitted, verdict=Verdict.AMBIGUOUS):
    """Two rounds: the current is taken, then nothing."""
    before, after = {"u": 0.06, "v": 0.11, "r": 0.02}, {"u": 0.02, "v": 0.03, "r": 0.01}
    names = (("current", None, 412.0), ("wind", None, 365.0), ("heading_bias", None, 40.2),
             ("actuator_lag", "rudder", 6.0), ("quadratic_damping", None, -4.2))  # fmt: skip
    first = tuple(
        Candidate(n, i, e, min(1.0, float(np.exp(-e / 2)) * 5), before, after if e > 100 else before)
        for n, i, e in names
    )
    second = tuple(
        Candidate(
            n,
            i,
            e - 420 if e > 100 else e / 8,
            0.8,
            after,
            after,
            note="" if n != "wind" else "did not converge",
        )
        for n, i, e in names[1:]
    )
    tests = tuple(
        ResidualTest(n, c, s, p)
        for n, s, p in (("whiteness", 812.4, 1e-30), ("rudder cross-correlation", 9.1, 0.25))
        for c in CHANNELS
    )
    quiet = tuple(replace(t, statistic=t.statistic / 90, p_value=0.4) for t in tests)
    taken = TakenEffect(fitted, 2.4e-9, ("wind",) if verdict is Verdict.AMBIGUOUS else ())
    return Diagnosis(
        verdict=verdict,
        effects=(taken,),
        rounds=(Round(tests, first, "current"), Round(quiet, second, None)),
        unexplained={"u": 0.04, "v": 0.06, "r": 0.02},
        advice="Repeat one zigzag on the reciprocal heading: current and wind separate there.",
    )


def example_results(logs=4, duration=60.0, rate=20.0, utc=True, origin=(59.43, 24.75), loop=True):
    """Several trials, one effect taken."""
    kinds = ("zigzag", "circle", "random", "zigzag")
    made = [
        make_trial(f"logs/{kinds[i % 4]}{i}.nmea", kinds[i % 4], "validate" if i == logs - 1 else "identify",
                   duration, rate, i, UTC if utc else None, origin)
        for i in range(logs)
    ]  # fmt: skip
    trials = tuple(m[0] for m in made)
    predictions = {t.name: prediction_of(t, lag) for t, lag in made}
    actuators = {
        t.name: pd.DataFrame({"t": t.states["t"], "rudder": lag, "n": t.inputs["n"].value}) for t, lag in made
    }
    fitted = FittedEffect(
        "current",
        None,
        (Estimated("", "speed", 0.178, 0.004, "m/s"), Estimated("", "direction", 1.31, 0.02, "rad")),
    )
    after = validation_of(predictions, "_after" if loop else "_before")
    before = make_fit()
    return Results(
        campaign="harbour/campaign.toml",
        logs=tuple(
            Log(
                Path("/data/harbour") / t.name,
                "nmea0183",
                {},
                messages=4000 + i,
                bytes_read=250_000,
                bytes_damaged=0 if i else 312,
                findings=()
                if i
                else (
                    Finding("damaged", "checksum does not match", 1200, 312, "GGA", 4),
                    Finding("gap", "no position for 2.4 s", topic="GGA"),
                ),
            )
            for i, t in enumerate(trials)
        ),
        trials=trials,
        before=before,
        after=make_fit((fitted,)) if loop else before,
        validation_before=validation_of(predictions, "_before"),
        validation_after=after,
        diagnosis=make_diagnosis(fitted) if loop else None,
        predictions=predictions,
        actuators=actuators,
        timing_s={"ingest": 0.4, "preprocess": 1.2, "identify": 5.1, "validate": 8.0, "total": 14.7},
        equations=(
            "u̇ = −0.55 |u|u + 0.0035 |n|n",
            "v̇ = −0.9 v − 0.45 ur − 0.08 δ",
            "ṙ = −1.1 r + 0.35 v + 0.55 δ",
        ),
        papers=(
            "Blanke, M. (1981). Ship propulsion losses related to automatic steering.",
            "Fossen, T. I. (2011). Handbook of Marine Craft Hydrodynamics and Motion Control.",
        ),
    )
