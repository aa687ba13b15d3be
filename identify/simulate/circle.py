"""Turning circle: helm over and held (IMO MSC.137(76), 4.3.1; ITTC 7.5-04-02-01)."""

from __future__ import annotations

import math

import numpy as np

from identify.simulate.measures import at, crossing
from identify.simulate.order import Order
from identify.simulate.plant import Plant, Track, sail
from identify.simulate.short import short_of_heading

#: Change of heading at which it ends, rad.
END = math.radians(540.0)
#: Change of heading from which on the turn is steady, rad.
STEADY = math.radians(360.0)
#: Time given, in ship lengths at approach speed.
PATIENCE = (40.0, 160.0)


def run_circle(plant: Plant, order: Order) -> Track:
    """Put the helm over and hold it until the heading has changed by 540 degrees."""
    length_time = plant.rebuilt.structure.vessel.length / plant.speed
    for lengths in PATIENCE:
        track = sail(plant, [(0.0, order.side * order.helm, 1.0)], lengths * length_time)
        end = crossing(track.t, order.side * track.states[:, 2], END)
        if math.isfinite(end):
            n = int(np.searchsorted(track.t, end)) + 1
            return Track(track.t[:n], track.states[:n], {k: v[:n] for k, v in track.inputs.items()})
    return track


def measure_circle(track: Track, order: Order) -> dict[str, float]:
    """Advance and transfer at 90°, tactical diameter at 180°, and the steady turn over the last 180°."""
    turned = order.side * track.states[:, 2]
    quarter, half, last = (
        crossing(track.t, turned, a) for a in (math.radians(90.0), math.radians(180.0), STEADY)
    )
    x, y = track.states[:, 0], order.side * track.states[:, 1]
    speed, rate, drift = _steady(track, last)
    return {
        "advance": at(track.t, x, quarter),
        "transfer": at(track.t, y, quarter),
        "tactical_diameter": at(track.t, y, half),
        "final_diameter": 2.0 * speed / abs(rate) if rate else math.nan,
        "time_to_90": quarter,
        "time_to_180": half,
        "steady_speed": speed,
        "steady_yaw_rate": rate,
        "steady_drift": drift,
    }


def short_of_circle(track: Track, order: Order) -> str:
    """Why its measures were not all reached; nothing where they were."""
    came = float(np.max(order.side * track.states[:, 2]))
    return "" if came >= STEADY else short_of_heading(track, "the order", 0.0, came, STEADY)


def _steady(track: Track, begin: float) -> tuple[float, float, float]:
    """Mean speed, yaw rate and drift angle from a time on."""
    if not math.isfinite(begin):
        return math.nan, math.nan, math.nan
    u, v, r = track.states[track.t >= begin, 3:6].T
    return float(np.mean(np.hypot(u, v))), float(np.mean(r)), float(np.mean(np.arctan2(-v, u)))
