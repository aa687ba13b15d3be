"""Direct spiral: the steady yaw rate of each helm, from one side to the other and back (Dieudonné 1953)."""

from __future__ import annotations

import math

import numpy as np

from identify.simulate.order import Order
from identify.simulate.plant import Command, Plant, Track, sail

#: Share of the greatest helm of each step on the way to zero.
SHARES = (1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05, 0.0)
#: Time that each helm is held, in ship lengths at approach speed.
HOLD = 25.0

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def helms(order: Order) -> FloatArray:
    """The helms in turn, down and up again, rad."""
    down = np.array([*SHARES, *(-s for s in SHARES[-2::-1])])
    return order.side * order.helm * np.concatenate([down, down[-2::-1]])


def run_spiral(plant: Plant, order: Order) -> Track:
    """Hold each helm until the turn is steady."""
    hold = HOLD * plant.rebuilt.structure.vessel.length / plant.speed
    commands: list[Command] = [(k * hold, float(a), 1.0) for k, a in enumerate(helms(order))]
    return sail(plant, commands, len(commands) * hold)


def steady_turns(track: Track, order: Order) -> tuple[FloatArray, FloatArray]:
    """Helm (k,) and the yaw rate (k,) at the end of its time."""
    angles = helms(order)
    hold = track.t[-1] / len(angles)
    place = np.floor(track.t / hold).astype(int)
    late = (track.t / hold - place) > 0.9
    rates = [float(np.mean(track.states[(place == k) & late, 5])) for k in range(len(angles))]
    return angles, np.array(rates)


def measure_spiral(track: Track, order: Order) -> dict[str, float]:
    """Width and height of the loop (zero for a course-stable vessel), and the yaw rate that is left at zero helm."""
    angles, rates = steady_turns(track, order)
    k = len(angles) // 2
    down, up = rates[: k + 1], rates[k:][::-1]
    middle = int(np.argmin(np.abs(angles[: k + 1])))
    return {
        "loop_height": float(abs(down[middle] - up[middle])),
        "loop_width": abs(_zero(angles[: k + 1], down) - _zero(angles[: k + 1], up)),
        "yaw_rate_at_zero": float(0.5 * (down[middle] + up[middle])),
    }


def short_of_spiral(track: Track, order: Order) -> str:
    """Why the loop has no width; nothing where it has one."""
    if math.isfinite(measure_spiral(track, order)["loop_width"]):
        return ""
    helm = math.degrees(order.helm)
    return (
        f"Not reached: on one of the ways between {helm:g}° of helm to both sides the turn keeps to one side."
    )


def _zero(angles: FloatArray, rates: FloatArray) -> float:
    """Helm at which the turn changes its side."""
    turns = np.nonzero(np.sign(rates[:-1]) != np.sign(rates[1:]))[0]
    if len(turns) == 0:
        return math.nan
    j = int(turns[0])
    share = rates[j] / (rates[j] - rates[j + 1])
    return float(angles[j] + share * (angles[j + 1] - angles[j]))
