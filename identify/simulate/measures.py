"""What is read off a manoeuvre: names, units, and the limits that IMO sets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Unit of every measure.
UNITS = {
    "first_overshoot": "rad",
    "second_overshoot": "rad",
    "first_execute_time": "s",
    "second_execute_time": "s",
    "initial_turning": "m",
    "period": "s",
    "advance": "m",
    "transfer": "m",
    "tactical_diameter": "m",
    "final_diameter": "m",
    "time_to_90": "s",
    "time_to_180": "s",
    "steady_speed": "m/s",
    "steady_yaw_rate": "rad/s",
    "steady_drift": "rad",
    "track_reach": "m",
    "head_reach": "m",
    "side_reach": "m",
    "stopping_time": "s",
    "loop_width": "rad",
    "loop_height": "rad/s",
    "yaw_rate_at_zero": "rad/s",
}


@dataclass(frozen=True)
class Measure:
    """One measure of a manoeuvre.

    Attributes
    ----------
    name, unit : str
        SI.
    value : float
        With the parameters as identified; NaN where the manoeuvre did not come so far.
    stderr, low, high : float
        Standard deviation and 95 % interval over the parameters' uncertainty; NaN without one, as where more than a few
        per cent of the draws failed. The interval always holds the value.
    limit : float, optional
        What IMO MSC.137(76) allows at most; it is meant for ships of 100 m and more.
    """

    name: str
    value: float
    unit: str
    stderr: float = math.nan
    low: float = math.nan
    high: float = math.nan
    limit: float | None = None


def imo_limits(kind: str, helm: float, length: float, speed: float) -> dict[str, float]:
    """Limits of IMO MSC.137(76), 5.3, for this manoeuvre.

    Parameters
    ----------
    kind : str
    helm : float
        Helm angle, rad.
    length, speed : float
        m, m/s.
    """
    degrees = round(math.degrees(helm), 6)
    if kind == "circle" and degrees >= 35.0:
        return {"advance": 4.5 * length, "tactical_diameter": 5.0 * length}
    if kind == "stopping":
        return {"track_reach": 15.0 * length}
    if kind == "zigzag" and degrees == 10.0:
        first, second = _overshoot_limits(length / speed)
        return {
            "first_overshoot": math.radians(first),
            "second_overshoot": math.radians(second),
            "initial_turning": 2.5 * length,
        }
    if kind == "zigzag" and degrees == 20.0:
        return {"first_overshoot": math.radians(25.0)}
    return {}


def _overshoot_limits(seconds: float) -> tuple[float, float]:
    """Overshoots of the 10/10 zigzag, degrees, by length over speed."""
    if seconds < 10.0:
        return 10.0, 25.0
    if seconds < 30.0:
        return 5.0 + 0.5 * seconds, 17.5 + 0.75 * seconds
    return 20.0, 40.0


def crossing(t: FloatArray, values: FloatArray, level: float, after: float = -np.inf) -> float:
    """First time after ``after`` at which values (n,) rise to a level; NaN if never."""
    inside = (t[1:] > after) & (values[1:] >= level) & (values[:-1] < level)
    rows = np.nonzero(inside)[0]
    if len(rows) == 0:
        return math.nan
    k = int(rows[0])
    share = (level - values[k]) / (values[k + 1] - values[k])
    return float(t[k] + share * (t[k + 1] - t[k]))


def at(t: FloatArray, values: FloatArray, when: float) -> float:
    """Value at a time; NaN for NaN."""
    return float(np.interp(when, t, values)) if math.isfinite(when) else math.nan
