# ruff: noqa: ANN001, ANN201
"""Preprocessing of measured data, where they lie beside the project: against what was logged, and against itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from preprocess.trials import make_trials
from seatrial import load_campaign
from seatrial.pipeline import read_logs, runs_of

DATA = Path(__file__).parents[2] / "shared" / "data"


def measured() -> None:
    """Print what the measured data show; nothing where they are not there."""
    if not DATA.is_dir():
        print("\nthe measured data are not beside the project")
        return
    tanker()
    boat()


def trials_of(folder: str, quantities=None):
    """The logs and the trials of a campaign, of some of its sensors only where ``quantities`` are given."""
    campaign = load_campaign(DATA / folder / "campaign.toml")
    logs = read_logs(campaign)
    sensors = {s.quantity: s for s in campaign.sensors if quantities is None or s.quantity in quantities}
    if quantities is not None:
        kept = [
            replace(log, sources=tuple(s for s in log.sources if s.quantity in quantities)) for log in logs
        ]
    else:
        kept = logs
    return logs, make_trials(runs_of(campaign, kept), campaign.vessel, campaign.inputs, sensors)


def tanker() -> None:
    print("\nKVLCC2 at HSVA: u, v, r from positions and heading alone against the logged ones,")
    print("root mean square of the difference in m/s, rad/s, and over the standard deviation; noise found")
    logs, trials = trials_of("kvlcc2-hsva", ("position", "heading"))
    for log, trial in zip(logs, trials, strict=True):
        logged = logged_motion(log)
        s, shown = trial.states, []
        for name, values in logged.items():
            error = s[name] - np.interp(s["t"], logged_times(log), values)
            rms = float(np.sqrt(np.nanmean(error**2)))
            shown.append(f"{name} {rms:.5f} ({rms / values.std():.4f})")
        m = trial.measurements
        print(
            f"  {trial.name:32s}" + "  ".join(shown) + f"  position {m['position'].sigma:.1e} m,"
            f" heading {m['heading'].sigma:.1e} rad"
        )


def logged_times(log):
    return log.tables[""].index.to_numpy() * 1e-9


def logged_motion(log):
    """Surge, sway and yaw rate as the basin logged them."""
    table = log.tables[""]
    psi, rate = np.radians(table["psi_deg"].to_numpy()), np.radians(table["r_deg_s"].to_numpy())
    north, east = table["vn"].to_numpy(), table["ve"].to_numpy()
    return {
        "u": north * np.cos(psi) + east * np.sin(psi),
        "v": -north * np.sin(psi) + east * np.cos(psi),
        "r": rate,
    }


def boat() -> None:
    print("\nBlueBoat: gyro against the turn of the heading alone (scale, rest, correlation); noises found;")
    print(
        "course less heading at more than 1 m/s without turning, degrees; clocks (offset ± standard error, s)"
    )
    _, both = trials_of("blueboat")
    _, alone = trials_of("blueboat", ("position", "heading"))
    for trial, bare in zip(both, alone, strict=True):
        gyro, s = trial.measurements["yaw_rate"], bare.states.dropna()
        r = np.interp(gyro.t, s["t"], s["r"])
        scale = float(r @ gyro.value / (r @ r))
        rest, alike = np.std(gyro.value - scale * r), np.corrcoef(r, gyro.value)[0, 1]
        steady = s[(np.hypot(s["u"], s["v"]) > 1.0) & (s["r"].abs() < 0.1)]
        drift = np.degrees(np.arctan2(steady["v"], steady["u"]))
        m = trial.measurements
        (step,) = [x for x in trial.history if x.action == "clock_offsets"]
        clocks = ", ".join(f"{k} {v[1]:+.2f} ± {v[2]:.2f}" for k, v in step.arguments.items())
        print(
            f"  {trial.name}  {scale:.3f} {rest:.3f} rad/s {alike:.4f}; position {m['position'].sigma:.3f} m,"
            f" heading {np.degrees(m['heading'].sigma):.2f}°, gyro {m['yaw_rate'].sigma:.4f} rad/s;"
            f" {drift.median():+.1f} ({drift.std():.1f}); {clocks}"
        )
