"""Which ROS 2 and Foxglove messages hold which quantity (REP-103: x forward, y to port, yaw from east)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ingest.detect import Rule

if TYPE_CHECKING:
    import pandas as pd

#: The sender's own time, beside that of recording.
_STAMPED: Mapping[str, object] = {"time": "stamp_ns", "time_unit": "ns"}
_ENU: Mapping[str, object] = {"frame": "enu"}
#: Usual errors, m, of NavSatStatus: plain, by satellites' corrections, by a ground station's.
USUAL_ERRORS: Mapping[int, float] = {0: 2.5, 1: 1.0, 2: 0.1}
_LATLON = {"latitude": "latitude", "longitude": "longitude"}
#: Frames whose axes turn with the vessel.
_BODY_FRAMES = ("base", "body", "imu", "fcu", "hull", "ship", "vessel", "boat", "usv")


def rules_for(schema: str, topic: str, table: pd.DataFrame) -> list[Rule]:
    """Rules for the messages of one topic, by the last part of their type's name."""
    kind = re.split(r"[/.]", schema)[-1]
    make = _KINDS.get(kind)
    rules = [] if make is None else make(re.escape(topic), table)
    return [replace(rule, options={**rule.options, **_STAMPED}) for rule in rules]


def _fix(topic: str, table: pd.DataFrame) -> list[Rule]:
    options: dict[str, object] = dict(_variance("position_covariance[0]"))
    if "status.status" in table:
        options |= {"quality": "status.status", "quality_min": 0, "fixes": USUAL_ERRORS}
    return [Rule("position", topic, _LATLON, "deg", 55, options)]


def _variance(column: str) -> dict[str, object]:
    """Options of a sensor that states the variance of its values in a column; zeros and negative ones say nothing."""
    return {"accuracy": column, "accuracy_power": 0.5}


def _imu(topic: str, table: pd.DataFrame) -> list[Rule]:
    yaw, rate = _variance("orientation_covariance[8]"), _variance("angular_velocity_covariance[8]")
    return [
        Rule("heading", topic, {"value": "yaw"}, "rad", 50, {**_ENU, **yaw}),
        Rule("yaw_rate", topic, {"value": "angular_velocity.z"}, "rad/s", 55, {**_ENU, **rate}),
    ]


def _pose(at: str, rank: float, topic: str) -> list[Rule]:
    return [
        Rule("position", topic, {"north": f"{at}position.y", "east": f"{at}position.x"}, "m", rank),
        Rule("heading", topic, {"value": f"{at}yaw"}, "rad", rank, _ENU),
    ]


def _twist(at: str, rank: float, topic: str, body: bool) -> list[Rule]:
    forward, port = f"{at}linear.x", f"{at}linear.y"
    fields = {"forward": forward, "starboard": port} if body else {"north": port, "east": forward}
    options = _ENU if body else {}
    return [
        Rule("velocity", topic, fields, "m/s", rank, options),
        Rule("yaw_rate", topic, {"value": f"{at}angular.z"}, "rad/s", rank - 2, _ENU),
    ]


def _odometry(topic: str, table: pd.DataFrame) -> list[Rule]:
    return [*_pose("pose.pose.", 42, topic), *_twist("twist.twist.", 42, topic, body=True)]


def _pose_stamped(topic: str, table: pd.DataFrame) -> list[Rule]:
    return _pose("pose.pose." if "pose.pose.position.x" in table else "pose.", 45, topic)


def _twist_stamped(topic: str, table: pd.DataFrame) -> list[Rule]:
    at = "twist.twist." if "twist.twist.linear.x" in table else "twist."
    return _twist(at, 48, topic, _in_body(table))


def _in_body(table: pd.DataFrame) -> bool:
    """Whether the frame of the message turns with the vessel."""
    if "header.frame_id" not in table:
        return False
    frame = table["header.frame_id"].dropna()
    return bool(len(frame)) and any(name in str(frame.iloc[0]).lower() for name in _BODY_FRAMES)


def _quaternion(topic: str, table: pd.DataFrame) -> list[Rule]:
    return [Rule("heading", topic, {"value": "yaw"}, "rad", 50, _ENU)]


def _vector(topic: str, table: pd.DataFrame) -> list[Rule]:
    if "velocity" not in topic and "vel" not in topic:
        return []
    fields = {"north": "vector.y", "east": "vector.x"}
    body = {"forward": "vector.x", "starboard": "vector.y"}
    return [
        Rule(
            "velocity", topic, body if _in_body(table) else fields, "m/s", 45, _ENU if _in_body(table) else {}
        )
    ]


def _joints(topic: str, table: pd.DataFrame) -> list[Rule]:
    """Rudders by the angle of their joint, propellers by the rate of theirs, where a joint is called so."""
    rules = []
    for column in (c for c in map(str, table.columns) if c.startswith("name[")):
        name, place = str(table[column].iloc[0]) if len(table) else "", column.removeprefix("name")
        for quantity, called, value, unit in _JOINTS:
            if f"{value}{place}" in table and re.search(called, name, re.IGNORECASE):
                rules.append(Rule(quantity, topic, {"value": f"{value}{place}"}, unit, 50))
    return rules


#: Actuators of joint states: quantity, names of joints, which of their values, and its unit by convention.
_JOINTS = (
    ("rudder", "rudder", "position", "rad"),
    ("propeller", "prop|shaft|screw|thruster", "velocity", "rad/s"),
)

_KINDS = {
    "NavSatFix": _fix,
    "LocationFix": _fix,
    "Imu": _imu,
    "Odometry": _odometry,
    "PoseStamped": _pose_stamped,
    "PoseWithCovarianceStamped": _pose_stamped,
    "PoseInFrame": _pose_stamped,
    "TwistStamped": _twist_stamped,
    "TwistWithCovarianceStamped": _twist_stamped,
    "QuaternionStamped": _quaternion,
    "Vector3Stamped": _vector,
    "JointState": _joints,
}
