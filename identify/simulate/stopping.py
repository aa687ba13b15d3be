"""Crash stop: full astern from the approach speed until there is no way left (IMO MSC.137(76), 4.3.4)."""

from __future__ import annotations

import math

import numpy as np

from identify.simulate.measures import at, crossing
from identify.simulate.order import Order
from identify.simulate.plant import Plant, Track, sail

#: Time given, in ship lengths at approach speed.
PATIENCE = (15.0, 60.0, 240.0)


def run_stopping(plant: Plant, order: Order) -> Track:
    """Order thrust astern and wait until the vessel has stopped."""
    length_time = plant.rebuilt.structure.vessel.length / plant.speed
    for lengths in PATIENCE:
        track = sail(plant, [(0.0, 0.0, -order.reverse)], lengths * length_time)
        end = _stopped(track)
        if math.isfinite(end):
            n = int(np.searchsorted(track.t, end)) + 1
            return Track(track.t[:n], track.states[:n], {k: v[:n] for k, v in track.inputs.items()})
    return track


def _stopped(track: Track) -> float:
    return crossing(track.t, -track.states[:, 3], 0.0)


def short_of_stop(track: Track, _: Order) -> str:
    """Why its measures were not reached; nothing where they were."""
    if math.isfinite(_stopped(track)):
        return ""
    t, u = track.t[-1], track.states[-1, 3]
    return f"Not reached: {t:.3g} s after the order astern the vessel makes {u:.3g} m/s ahead."


def measure_stopping(track: Track, _: Order) -> dict[str, float]:
    """Reach along the track, ahead and to the side, and the time it took."""
    end = _stopped(track)
    return {
        "track_reach": at(track.t, track.path, end),
        "head_reach": at(track.t, track.states[:, 0], end),
        "side_reach": at(track.t, track.states[:, 1], end),
        "stopping_time": end,
    }
