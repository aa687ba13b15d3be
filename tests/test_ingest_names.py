"""What columns of tables and joints of ROS are called in the field, and what they are taken for."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ingest.log import Log
from ingest.ros.rules import rules_for
from ingest.tabular.naming import sources_of
from seatrial.inspection import named_inputs


def table_of(*names):
    t = np.arange(0.0, 20.0)
    return pd.DataFrame({n: 10.0 + k + t for k, n in enumerate(names)}, index=pd.Index(t * 1e9, name="t_ns"))


def found_in(*names):
    return {(s.quantity, *s.fields.values()) for s in sources_of(table_of(*names), {})}


@pytest.mark.parametrize(
    ("north", "east"),
    [("GNSS lat", "GNSS lon"), ("gps_latitude", "gps_longitude"), ("vessel_lat_deg", "vessel_lon_deg"),
     ("lat_dd", "lon_dd"), ("RTK Latitude (deg)", "RTK Longitude (deg)"), ("pos_lat", "pos_lng")],
)  # fmt: skip
def test_a_position_by_any_of_its_names(north, east):
    assert found_in(north, east) == {("position", north, east)}


@pytest.mark.parametrize(
    "name",
    ["hdg_true", "hdg_deg", "true_heading", "heading_true_deg", "GPS Heading (deg)", "vessel_heading", "yaw_deg", "psi",
     "fused_yaw_deg", "gnss_hdg_deg"],
)  # fmt: skip
def test_a_heading_by_any_of_its_names(name):
    (source,) = sources_of(table_of(name), {})
    assert (source.quantity, source.options.get("magnetic")) == ("heading", None)


@pytest.mark.parametrize(
    "name", ["hdg_mag", "compass_heading_deg", "mag_hdg", "magnetic_heading", "heading_compass"]
)
def test_a_heading_of_a_compass_is_magnetic(name):
    (source,) = sources_of(table_of(name), {})
    assert (source.quantity, source.options.get("magnetic")) == ("heading", True)


@pytest.mark.parametrize(
    "name", ["yaw_rate_dps", "filtered_yaw_rate", "yawspeed", "yaw_rate_gyro", "hdg_rate_deg_s"]
)
def test_a_yaw_rate_by_any_of_its_names(name):
    assert found_in(name) == {("yaw_rate", name)}


@pytest.mark.parametrize(
    "name", ["heading_error", "heading_setpoint", "desired_heading", "yaw_rate_setpoint", "psi_ref"]
)
def test_what_is_wanted_of_a_heading_is_none(name):
    assert found_in(name) == set()


@pytest.mark.parametrize(
    ("speed", "direction", "reference"),
    [("wind_speed_true", "wind_dir_true", "true"), ("true_wind_speed", "true_wind_dir", "true"),
     ("wind_speed_apparent", "wind_angle_apparent", "relative"), ("rel_wind_speed", "rel_wind_dir", "relative")],
)  # fmt: skip
def test_winds_by_their_names(speed, direction, reference):
    winds = [s for s in sources_of(table_of(speed, direction), {}) if s.quantity == "wind"]
    assert {w.options["reference"] for w in winds} == {reference}


def test_a_course_over_ground_may_say_of_which_north():
    assert ("velocity", "sog_kn", "cog_true") in found_in("sog_kn", "cog_true")


def test_a_shaft_of_one_side_is_offered_once():
    found = [s.fields["value"] for s in sources_of(table_of("shaft_port_rpm", "shaft_stbd_rpm"), {})]
    assert sorted(found) == ["shaft_port_rpm", "shaft_stbd_rpm"]


def joints(**columns):
    n = 50
    names = {f"name[{k}]": [name] * n for k, name in enumerate(["rudder_joint", "propeller", "camera"])}
    return pd.DataFrame({**names, **columns}, index=pd.Index(np.arange(n) * 100_000_000, name="t_ns"))


def test_joints_that_are_called_so_are_rudder_and_propeller():
    angles = {f"position[{k}]": np.linspace(-0.5, 0.5 + k, 50) for k in range(3)}
    table = joints(**angles, **{"velocity[1]": np.linspace(10.0, 50.0, 50)})
    rules = rules_for("sensor_msgs/msg/JointState", "/joints", table)
    assert {(r.quantity, *r.fields.values(), r.unit) for r in rules} == {
        ("rudder", "position[0]", "rad"),
        ("propeller", "velocity[1]", "rad/s"),
    }
    log = Log(Path("joints.mcap"), "mcap", {"/joints": table})
    assert {c.signal for c in named_inputs(log)} == {
        f"/joints.{x}" for x in ("position[0]", "position[1]", "velocity[1]")
    }
