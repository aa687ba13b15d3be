# ruff: noqa: ANN001, ANN201
"""How often a clock is said to be off, with and without a world that could be taken for one, and how sure it says so.

.venv/bin/python -m benchmarks.preprocess_false_clocks [seeds]
"""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import product

import numpy as np

from benchmarks.preprocess_cases import NOISE, Imperfect, sampled, trial_of
from fixtures.effects import Effect, World
from fixtures.manoeuvres import make_manoeuvre
from fixtures.simulator import simulate
from fixtures.vessels import make_vessel

#: Vessel, manoeuvre (a zigzag at one speed of the propeller), and whether a yaw rate is logged.
SAILED = (
    ("usv", "zigzag", False),
    ("patrol", "zigzag", True),
    ("catamaran", "random", True),
)
WORLDS = ("calm", "current", "wind", "antenna", "compass")
RATES = {"position": 5.0, "heading": 10.0, "yaw_rate": 20.0}
#: Streams and the names that findings have for them.
STREAMS = {"yaw_rate": "yaw_rate", "position": "position", "inputs": "the inputs"}
#: True offsets, s, in turn; length of a log, s; error of the compass, rad; interval of the inputs, s.
DELAYS, DURATION, TURNED, LOGGED = (0.3, 0.5, -0.3), 100.0, 0.07, 0.1
#: Speed of the current over the vessel's, and place of an undeclared antenna over its length.
DRIFT, ANTENNA = 0.15, (0.25, 0.08)


def log_of(vessel: str, manoeuvre: str, gyro: bool, world: str, stream: str | None, seed: int):
    """What is logged in a world, the stamps of one stream late; and how late."""
    ship = make_vessel(vessel)
    direction, blow = 2.4 * seed, {"cx": 0.0008, "cy": 0.0016, "cn": 0.0002, "speed": 6.0, "gust": 0.1}
    effects = {
        "current": Effect("current", {"speed": DRIFT * ship.speed, "direction": direction}),
        "wind": Effect("wind", blow | {"direction": direction}),
    }
    acting = World(tuple(e for k, e in effects.items() if k == world))
    made_of = make_manoeuvre(manoeuvre, ship, DURATION, seed)
    if manoeuvre == "zigzag":
        made_of = replace(made_of, legs=tuple(replace(x, throttle=1.0) for x in made_of.legs))
    truth = simulate(ship, made_of, acting, seed=seed, heading=1.3 * seed)
    delay = 0.0 if stream is None else DELAYS[seed % len(DELAYS)]
    sensors = {
        k: Imperfect(rate, NOISE[k], delay=delay * (k == stream))
        for k, rate in RATES.items()
        if gyro or k != "yaw_rate"
    }
    place = tuple(x * ship.length for x in ANTENNA) if world == "antenna" else (0.0, 0.0)
    made = sampled(truth, seed, antenna=place, **sensors)
    tables = made.log.tables
    if world == "compass":
        tables["heading"] = np.mod(tables["heading"] + TURNED, 2.0 * np.pi)
    if stream == "inputs":
        tables["act"] = later(tables["act"], delay)
    return replace(made, vessel=replace(made.vessel, antenna=(0.0, 0.0))), delay


def later(table, delay: float):
    """A table with stamps moved; what would stand before the log's start is lost."""
    index = table.index.to_numpy() + round(delay * 1e9)
    out = table[index >= 0].copy()
    out.index = type(table.index)(index[index >= 0], name=table.index.name)
    return out


def told(case, world: str, stream: str | None, seed: int):
    """Per stream: error, standard error and whether a sentence says it is off, of those told in one log."""
    made, delay = log_of(*case, world, stream, seed)
    trial = trial_of(made)
    (step,) = [s for s in trial.history if s.action == "clock_offsets"]
    out = {}
    for name, called in STREAMS.items():
        if called in step.arguments:
            _, offset, stderr, _ = step.arguments[called]
            # steps of the helm stand in the log at once: half the interval that is taken off them is put back
            found = offset + (0.5 * LOGGED if name == "inputs" else 0.0)
            said = any(f.startswith(f"The stamps of {called} are") for f in trial.findings)
            out[name] = (found - delay * (name == stream), stderr, said)
    return out


def main(seeds: int) -> None:
    """Print all cells."""
    print(
        "per world and late stream, over all vessels: said to be off / told / logs; share of 95 % intervals"
    )
    print("that hold the truth, where told; median standard error, s")
    for world, stream in product(WORLDS, (None, *STREAMS)):
        logs = [
            told(case, world, stream, seed)
            for case in SAILED
            for seed in range(seeds)
            if case[2] or stream != "yaw_rate"
        ]
        shown = [f"{name}: {in_words([x[name] for x in logs if name in x], len(logs))}" for name in STREAMS]
        print(f"{world:8s} late {stream or 'none':9s}| {' | '.join(shown)}", flush=True)


def in_words(found, count: int) -> str:
    """Sentences, told, logs; coverage and standard error."""
    if not found:
        return f"0/0/{count}"
    error, stderr, said = np.array(found, dtype=float).T
    held = np.mean(np.abs(error) < 1.96 * stderr)
    return f"{said.sum():.0f}/{len(found)}/{count} {held:.2f} {np.median(stderr):.3f}"


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2)
