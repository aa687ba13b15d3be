"""Frames and conventions: the one place where ENU, REP-103, courses and lever arms become NED and body axes.

Everywhere else in Seatrial `x` is north, `y` east, the heading runs clockwise from north, the body axes point
forward and to starboard, and the yaw rate is positive to starboard (SNAME 1950).
"""

from __future__ import annotations

import numpy as np

from preprocess.trial import FloatArray


def geodetic_to_ned(latitude: FloatArray, longitude: FloatArray, origin: tuple[float, float]) -> FloatArray:
    """WGS 84 to the local tangent plane.

    Parameters
    ----------
    latitude, longitude : (n,) degrees
    origin : (latitude, longitude), degrees

    Returns
    -------
    (n, 2) m
        North and east of the origin, in the plane that touches the ellipsoid there.
    """
    import pymap3d

    north, east, _ = pymap3d.geodetic2ned(latitude, longitude, 0.0, origin[0], origin[1], 0.0)
    return np.column_stack([np.atleast_1d(north), np.atleast_1d(east)]).astype(float)


def enu_yaw_to_heading(yaw: FloatArray) -> FloatArray:
    """REP-103 yaw (rad, anticlockwise from east) to heading (rad, clockwise from north)."""
    return np.pi / 2.0 - yaw


def flu_rate_to_yaw_rate(rate: FloatArray) -> FloatArray:
    """REP-103 rate about the axis that points up to the yaw rate about the axis that points down, rad/s."""
    return -rate


def flu_to_body(velocity: FloatArray) -> FloatArray:
    """REP-103 body velocity (forward, left) to (forward, starboard), (n, 2) m/s."""
    return np.asarray(velocity * np.array([1.0, -1.0]), float)


def course_to_north_east(speed: FloatArray, course: FloatArray) -> FloatArray:
    """Speed (m/s) and course over ground (rad) to north and east components, (n, 2) m/s."""
    return np.column_stack([speed * np.cos(course), speed * np.sin(course)])


def body_to_earth(vector: FloatArray, psi: FloatArray) -> FloatArray:
    """Rotate (n, 2) from (forward, starboard) to (north, east) by the heading ``psi`` (n,) rad."""
    c, s = np.cos(psi), np.sin(psi)
    return np.column_stack([vector[:, 0] * c - vector[:, 1] * s, vector[:, 0] * s + vector[:, 1] * c])


def earth_to_body(vector: FloatArray, psi: FloatArray) -> FloatArray:
    """Rotate (n, 2) from (north, east) to (forward, starboard) by the heading ``psi`` (n,) rad."""
    return body_to_earth(vector, -psi)


def lever_position(arm: tuple[float, float], psi: FloatArray) -> FloatArray:
    """Where a point of the hull at ``arm`` (m forward, starboard) lies from the origin: (n, 2) m NE."""
    return body_to_earth(np.tile(np.asarray(arm, float), (len(psi), 1)), psi)


def lever_velocity(arm: tuple[float, float], psi: FloatArray, r: FloatArray) -> FloatArray:
    """Return what a point at ``arm`` moves faster than the origin, by the yaw rate: (n, 2) m/s NE."""
    turned = np.column_stack([-arm[1] * r, arm[0] * r])
    return body_to_earth(turned, psi)


def wind_to_air_velocity(speed: FloatArray, direction_from: FloatArray) -> FloatArray:
    """Wind speed (m/s) and direction from (rad) to the velocity of the air (blows to), (n, 2) m/s."""
    return np.asarray(-course_to_north_east(speed, direction_from), float)


def unwrap(angle: FloatArray) -> FloatArray:
    """Continuous angle, rad; samples that are NaN stay NaN and do not break the rest."""
    out = np.array(angle, float)
    good = np.isfinite(out)
    out[good] = np.unwrap(out[good])
    return out


def nearest_turn(angle: FloatArray, reference: FloatArray) -> FloatArray:
    """``angle`` moved by whole turns to lie within half a turn of ``reference``, rad."""
    turns = np.round((reference - angle) / (2.0 * np.pi))
    return np.asarray(angle + 2.0 * np.pi * turns, float)
