"""Measured data: velocities from positions and heading against the logged ones; how sensors agree."""

from pathlib import Path

import numpy as np
import pytest

from ingest import read_log
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials
from preprocess.vessel import Input, Sensor, Vessel

DATA = Path(__file__).parents[2] / "shared" / "data"
pytestmark = [
    pytest.mark.real,
    pytest.mark.skipif(not DATA.is_dir(), reason="the measured data are not beside the project"),
]
COLUMNS = "t north east psi_deg vn ve r_deg_s roll_deg rudder_deg n thrust torque"


def test_tanker_velocities_from_positions_and_heading_alone():
    log = read_log(
        DATA / "kvlcc2-hsva" / "HSVA_CPMC_KVLCC2_Z_20_05.dat",
        dialect={"columns": COLUMNS, "skip": 4, "encoding": "cp1252"},
    )
    sensors = {
        "position": Sensor("position", {"north": "north", "east": "east"}, "m"),
        "heading": Sensor("heading", {"signal": "psi_deg"}, "deg"),
    }
    inputs = [
        Input("rudder", "rudder", "rudder_deg", unit="deg"),
        Input("propeller", "propeller", "n", unit="rev/s"),
    ]
    (trial,) = make_trials([LoggedRun("z20", log, "identify")], Vessel("KVLCC2", 7.0, 1.27), inputs, sensors)
    table = log.tables[""]
    t, psi = table.index.to_numpy() * 1e-9, np.radians(table["psi_deg"].to_numpy())
    vn, ve = table["vn"].to_numpy(), table["ve"].to_numpy()
    logged = {
        "u": vn * np.cos(psi) + ve * np.sin(psi),
        "v": -vn * np.sin(psi) + ve * np.cos(psi),
        "r": np.radians(table["r_deg_s"].to_numpy()),
    }
    for name, values in logged.items():
        error = trial.states[name] - np.interp(trial.states["t"], t, values)
        assert np.sqrt(np.nanmean(error**2)) < 0.02 * values.std(), name
    assert trial.manoeuvre == "zigzag"
    assert len(trial.segments) == 1


def test_boat_sensors_agree():
    log = read_log(DATA / "blueboat" / "00000239.bin")
    pwm, value = (1100.0, 1500.0, 1520.0, 1900.0), (1.0, 0.0, 0.0, -1.0)
    inputs = [
        Input("left", "thruster", "RCOU.C1", pwm, value),
        Input("right", "thruster", "RCOU.C3", pwm, value[::-1]),
    ]
    (trial,) = make_trials([LoggedRun("239", log, "identify")], Vessel("BlueBoat", 1.19, 0.93), inputs, {})
    assert len(trial.segments) == 1  # gaps of the position up to 2.4 s are bridged
    assert trial.measurements["yaw_rate"].sigma < 0.05
    gyro = trial.measurements["yaw_rate"]
    r = np.interp(gyro.t, trial.states["t"], trial.states["r"])
    assert np.corrcoef(r, gyro.value)[0, 1] > 0.98
    assert any("stamps of yaw_rate" in f for f in trial.findings)
    assert 1.5 < trial.states["u"].max() < 4.0
