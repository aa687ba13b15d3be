"""Something sets in on the way: how much it raises the prediction error, after how long it is noticed, its name."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.online_runs import CALM, identified, stream
from benchmarks.online_streams import turned, vessel_for
from fixtures.effects import Effect, World
from fixtures.vessels import Vessel
from seatrial.online.updates import ERRORS, Note, Reading


@dataclass(frozen=True)
class Kind:
    """Something that sets in: what came before, what comes, and the name that is right."""

    name: str
    before: World
    after: Callable[[Vessel, float], World]
    sizes: tuple[float, ...]
    right: str


def _load(vessel: Vessel, size: float) -> World:
    del vessel
    return World((Effect("mass_change", {"ratio": 1.0 + size}),))


def _lost(vessel: Vessel, size: float) -> World:
    first = next(a.name for a in vessel.actuators if a.kind in ("propeller", "thruster"))
    return World((Effect("thrust_asymmetry", {"ratio": 1.0 - size}, first),))


def _current(vessel: Vessel, size: float) -> World:
    return turned(size * vessel.speed, 120.0)


def _offset(vessel: Vessel, size: float) -> World:
    actuator = next((a for a in vessel.actuators if a.kind == "rudder"), vessel.actuators[0])
    return World((Effect("actuator_offset", {"offset": size * actuator.limit}, actuator.name),))


def _weed(vessel: Vessel, size: float) -> World:
    drag = size * abs(vessel.speed) / vessel.time_scale
    return World(
        (Effect("wash", {"every": 12.0, "lasting": 1.5, "u": drag, "v": drag, "r": drag / vessel.length}),)
    )


KINDS = (
    Kind("current sets in", CALM, _current, (0.02, 0.05, 0.15), "current"),
    Kind("propeller fouled", CALM, _lost, (0.04, 0.1, 0.4), "thrust_asymmetry"),
    Kind("load taken aboard", CALM, _load, (0.05, 0.12, 0.3), "mass_change"),
    Kind("actuator off its zero", CALM, _offset, (0.01, 0.03, 0.1), "actuator_offset"),
    Kind("wash of others (no effect)", CALM, _weed, (0.05, 0.15, 0.4), ""),
)  # fmt: skip


@dataclass(frozen=True)
class Noticed:
    """One change: by how much the ten-second errors rose, after how long it was noticed, what it was called."""

    kind: str
    vessel: str
    size: float
    ratio: float
    delay: float
    named: tuple[str, ...]
    right: bool
    early: int


def change(task: tuple[int, str, str, float, int, float, float]) -> Noticed:
    """One stream with a change."""
    number, vessel, form, size, seed, at, seconds = task
    kind = KINDS[number]
    world = kind.after(vessel_for(vessel, form), size)
    campaign, log = stream(vessel, form, [(0.0, kind.before), (at, world)], at + seconds, seed)
    identifier, updates = identified(campaign, log)
    errors = [
        (u.t, u.values["ten_seconds_distance"])
        for u in updates
        if isinstance(u, Reading) and u.topic == ERRORS
    ]
    t, e = np.array(errors).T
    before, after = (t > 60.0) & (t < at), (t > at + 10.0) & (t < at + 70.0)
    ratio = float(np.sqrt(np.nanmean(e[after] ** 2) / np.nanmean(e[before] ** 2)))
    warnings = [u.t for u in updates if isinstance(u, Note) and "stopped fitting" in u.text]
    delay = next((w - at for w in warnings if w > at), math.inf)
    assert identifier.estimator is not None
    late = [c for c in identifier.estimator.changes if c.told > at]
    suspicion = late[0].suspicion if late else None
    named = tuple(s.label for s in suspicion.named) if suspicion else ()
    first = {n.split(" ")[0] for n in named}
    right = (kind.right in first) if kind.right else bool(late) and not named
    return Noticed(kind.name, vessel, size, ratio, delay, named, right, sum(w <= at for w in warnings))
