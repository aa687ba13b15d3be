"""Zigzag: the helm is reversed whenever the heading has changed by so much (Kempf 1932; IMO MSC.137(76), 4.3.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from identify.simulate.measures import at, crossing
from identify.simulate.order import Order
from identify.simulate.plant import Command, Plant, Track, sail
from identify.simulate.short import short_of_heading

#: Helm orders given: enough for two overshoots and a whole period.
EXECUTES = 5
#: What these are called.
NUMBERS = ("first", "second", "third", "fourth", "fifth")
#: Time given to a leg, in ship lengths at approach speed; the second where the first did not do.
PATIENCE = (12.0, 60.0)


@dataclass(frozen=True)
class Zigzag:
    """A track with the times at which the helm was ordered over."""

    track: Track
    executes: tuple[float, ...]


def run_zigzag(plant: Plant, order: Order) -> Zigzag:
    """Steer a zigzag, leg by leg, each order given when the heading is reached, or the helm's delay later."""
    commands: list[Command] = [(0.0, order.side * order.helm, 1.0)]
    track, complete = _leg(plant, commands, order)
    while complete and len(commands) < EXECUTES:
        when = _reached(track, commands[-1], order) + order.helm_delay
        commands.append((when, -commands[-1][1], 1.0))
        track, complete = _leg(plant, commands, order)
    return Zigzag(track, tuple(c[0] for c in commands))


def _leg(plant: Plant, commands: list[Command], order: Order) -> tuple[Track, bool]:
    """Run to the end of the last leg, and whether its heading was reached."""
    length_time = plant.rebuilt.structure.vessel.length / plant.speed
    for lengths in PATIENCE:
        track = sail(plant, commands, commands[-1][0] + lengths * length_time)
        if math.isfinite(when := _reached(track, commands[-1], order)):
            return _cut(track, when), True
    return track, False


def _reached(track: Track, last: Command, order: Order) -> float:
    """When the heading has come to the side of the last order."""
    towards = math.copysign(1.0, last[1])
    return crossing(track.t, towards * track.states[:, 2], order.heading, last[0])


def _cut(track: Track, when: float) -> Track:
    n = int(np.searchsorted(track.t, when)) + 1
    return Track(track.t[:n], track.states[:n], {k: v[:n] for k, v in track.inputs.items()})


def measure_zigzag(zigzag: Zigzag, order: Order) -> dict[str, float]:
    """Overshoots, times and the distance run to the second execute."""
    track, times = zigzag.track, [*zigzag.executes, *[math.nan] * EXECUTES]
    return {
        "first_overshoot": _overshoot(track, times[1], times[2], order.side, order),
        "second_overshoot": _overshoot(track, times[2], times[3], -order.side, order),
        "first_execute_time": times[1],
        "second_execute_time": times[2],
        "initial_turning": at(track.t, track.path, times[1]),
        "period": times[4] - times[2],
    }


def short_of_zigzag(zigzag: Zigzag, order: Order) -> str:
    """Why its measures were not all reached; nothing where they were."""
    track, orders = zigzag.track, zigzag.executes
    if len(orders) == EXECUTES:
        return ""
    towards = order.side * (-1) ** (len(orders) - 1)
    came = float(np.max(towards * track.states[track.t >= orders[-1], 2]))
    return short_of_heading(track, f"the {NUMBERS[len(orders) - 1]} order", orders[-1], came, order.heading)


def _overshoot(track: Track, begin: float, end: float, side: int, order: Order) -> float:
    """How far the heading goes on after the helm was reversed; the peak between samples by a parabola."""
    if not (math.isfinite(begin) and math.isfinite(end)):
        return math.nan
    inside = (track.t >= begin) & (track.t <= end)
    psi = side * track.states[inside, 2]
    return float(_peak(psi) - order.heading) if len(psi) else math.nan


def _peak(values: np.ndarray) -> float:
    k = int(np.argmax(values))
    if k in (0, len(values) - 1):
        return float(values[k])
    a, b, c = values[k - 1 : k + 2]
    bend = a - 2 * b + c
    return float(b - (a - c) ** 2 / (8 * bend)) if bend < 0 else float(b)
