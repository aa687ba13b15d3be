"""Units that no column of a table states follow from the signals beside it, or else from the size of the values."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ingest.errors import CampaignError
from ingest.log import Log
from ingest.tabular.delimited import timed
from ingest.tabular.naming import sources_of
from ingest.tabular.unstated import guess_angle_unit
from ingest.units import measures
from preprocess.resolve import declared_source
from preprocess.vessel import Sensor
from seatrial import load_campaign
from seatrial.pipeline import read_logs

DEG = np.degrees(1.0)


def zigzag(most: float = 25.0, turns: float = 0.0, rate: float = 20.0) -> dict[str, np.ndarray]:
    """Heading (rad) up to ``most`` degrees to either side, or round and round, its slope, and the track."""
    t = np.arange(0.0, 120.0, 1.0 / rate)
    psi = np.radians(most) * np.sin(0.2 * t) + 2.0 * np.pi * turns * t / 120.0
    drift = 0.1 * np.cos(0.2 * t)
    x, y = (np.cumsum(1.5 * f(psi - drift)) / rate for f in (np.cos, np.sin))
    return {"t": t, "psi": psi, "r": np.gradient(psi, t), "x": x, "y": y}


def units(columns: dict[str, np.ndarray]) -> dict[str, str]:
    table = pd.DataFrame(
        {"time": np.arange(0.0, 120.0, 120.0 / len(next(iter(columns.values())))), **columns}
    )
    decoded = timed(table, {})
    return {s.quantity: s.unit for s in decoded.sources}


def test_unit_of_an_angle_from_its_values():
    turn = np.linspace(0, 2 * np.pi, 1000)
    assert guess_angle_unit(turn) == "rad"
    assert guess_angle_unit(np.degrees(2 * turn) % 360) == "deg"
    assert guess_angle_unit(2 * turn % (2 * np.pi)) == "rad"
    assert guess_angle_unit(np.full(10, 123.0)) == "deg"
    assert guess_angle_unit(25.0 * np.sin(turn)) == "deg"


def test_a_rudder_that_is_held_is_in_degrees():
    rudder = 20.0 * np.sign(np.sin(0.1 * np.arange(0.0, 120.0, 0.1)))
    assert units({"rudder": rudder})["rudder"] == "deg"
    assert units({"rudder": rudder / DEG})["rudder"] == "rad"


@pytest.mark.parametrize("unit", [1.0, DEG])
@pytest.mark.parametrize(("most", "turns"), [(25.0, 0.0), (3.0, 0.0), (0.0, 2.5), (10.0, -1.5)])
def test_the_track_says_what_a_heading_is_in(unit, most, turns):
    run = zigzag(most, turns, rate=100.0)
    found = units({"x": run["x"], "y": run["y"], "heading": run["psi"] * unit, "yaw_rate": run["r"] * unit})
    expected = ("deg", "deg/s") if unit > 1.0 else ("rad", "rad/s")
    assert (found["heading"], found["yaw_rate"]) == expected


def test_on_a_straight_run_the_track_says_so_too():
    run = zigzag(0.1)
    x, y = (f(np.radians(12.0)) * run["t"] for f in (np.cos, np.sin))
    assert units({"x": x, "y": y, "heading": 12.0 + run["psi"]})["heading"] == "deg"
    course = {"x": np.cos(12.0) * run["t"], "y": np.sin(12.0) * run["t"]}
    assert units({**course, "heading": 12.0 + run["psi"]})["heading"] == "rad"


@pytest.mark.parametrize("unit", [1.0, DEG])
def test_latitude_and_longitude_are_a_track(unit):
    run = zigzag(3.0)
    lat, lon = 60.0 + run["x"] / 111_200, 150.0 + run["y"] / 55_600
    found = units(
        {"lat": lat, "lon": lon, "heading": run["psi"] * unit, "sog": 1.5 + 0 * lat, "cog": run["psi"] * unit}
    )
    assert found["heading"] == found["velocity"] == ("deg" if unit > 1.0 else "rad")


@pytest.mark.parametrize("heading", [1.0, DEG])
@pytest.mark.parametrize("rate", [1.0, DEG])
def test_the_slope_of_a_heading_and_a_yaw_rate_say_each_others_unit(heading, rate):
    run = zigzag(10.0, 1.0)
    named = {1.0: "rad", DEG: "deg"}
    stated = f"r_{named[rate]}_s"
    assert units({"psi": run["psi"] * heading, stated: run["r"] * rate})["heading"] == named[heading]
    told = units({f"psi_{named[heading]}": run["psi"] * heading, "r": run["r"] * rate})
    assert told["yaw_rate"] == named[rate] + "/s"
    if heading != rate:
        both = units({"psi": run["psi"] * heading, "r": run["r"] * rate})
        assert (both["heading"], both["yaw_rate"]) == (named[heading], named[rate] + "/s")


def test_a_vessel_that_lies_still_says_nothing():
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 1200))
    assert units({"x": x, "y": y, "heading": 40.0 + rng.normal(size=1200)})["heading"] == "deg"
    assert units({"x": 0 * x, "y": 0 * y + 1.0, "heading": rng.normal(size=1200)})["heading"] == "rad"


def test_what_a_unit_was_taken_from_is_said():
    run = zigzag()
    table = pd.DataFrame({"time": run["t"], "x": run["x"], "y": run["y"], "heading": DEG * run["psi"]})
    (note,) = timed(table, {}).findings
    assert note.message == "'heading' states no unit; taken as deg from the course over the track"
    assert sources_of(table.set_axis(np.arange(len(table)) * 50_000_000), {})


def test_a_campaign_that_states_a_unit_hears_no_guess(tmp_path):
    run = zigzag()
    degrees = DEG * run["psi"]
    table = pd.DataFrame(
        {"t": run["t"], "x": run["x"], "y": run["y"], "Kurs": degrees, "rudder": degrees / 9}
    )
    table.to_csv(tmp_path / "a.csv", index=False)
    text = (
        '[vessel]\nname = "a"\nlength = 2.0\nbeam = 0.5\n[inputs.rudder]\nkind = "rudder"\nsignal = "rudder"\n{}'
        '[sensors.heading]\nsignal = "Kurs"\nunit = "deg"\n[model]\nname = "nomoto1"\n[[log]]\npath = "a.csv"\n'
    )
    said = []
    for unit in ("", 'unit = "deg"\n'):
        (tmp_path / "campaign.toml").write_text(text.format(unit))
        (log,) = read_logs(load_campaign(tmp_path / "campaign.toml"))
        said.append([f.message for f in log.findings if "states no unit" in f.message])
    assert said == [["'rudder' states no unit; taken as deg from its values"], []]


@pytest.mark.parametrize(
    ("quantity", "unit", "fits"),
    [
        ("velocity", "m/s", True), ("velocity", "kn", True), ("velocity", "ms", False), ("velocity", "m", False),
        ("heading", "deg", True), ("heading", "cdeg", True), ("heading", "deg/s", False), ("heading", "ms", False),
        ("velocity", "deg/s", False), ("velocity", "km/h", True), ("yaw_rate", "m/s", False), ("yaw_rate", "1/s", True),
        ("yaw_rate", "°/s", True), ("yaw_rate", "rev/min", True),
        ("yaw_rate", "deg/min", True), ("yaw_rate", "mrad/s", True), ("yaw_rate", "deg", False),
        ("position", "degE7", True),
    ],
)  # fmt: skip
def test_what_a_quantity_is_measured_in(quantity, unit, fits):
    assert measures(quantity, unit) == fits


def test_a_unit_that_a_quantity_cannot_have_is_refused():
    table = pd.DataFrame({"a [s]": [1.0], "b [s]": [2.0]}, index=pd.Index([0], name="t_ns"))
    log = Log(Path("x.csv"), "csv", {"": table}, {("", c): "s" for c in table})
    sensor = Sensor("velocity", {"north": "a [s]", "east": "b [s]"})
    with pytest.raises(
        CampaignError, match=r"sensors\.velocity\.unit: expected the unit of 'b \[s\]'.*states 's'"
    ):
        declared_source(log, sensor)
    assert declared_source(log, replace(sensor, unit="m/s")).unit == "m/s"
