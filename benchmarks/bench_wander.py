"""``python -m benchmarks.bench_wander``: receivers whose errors wander by a good part of the vessel's length.

Ordinary satellite receivers are off by a metre or so that comes and goes within a minute. Campaigns of small vessels
are drawn with such receivers, every other one in a current that the declared model does not know, and analysed from
their logs: what lacks nothing should be called adequate, and the current named.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from fixtures.campaign import DEFAULT_SUITE, FORMATS, record_campaign, write_campaign
from fixtures.effects import Effect, World
from fixtures.sensors import Sensor
from fixtures.vessels import VESSELS, make_vessel

MANOEUVRES = ("zigzag", "circle", "random", "speed", "zigzag", "random")
#: Length of a log, s, and speed of the current over that of the vessel.
DURATION, CURRENT = 120.0, 0.2
#: What is drawn: standard deviation of the wander, m, its time constant, s, positions per second, white noise, m.
SIZES, TIMES, RATES, WHITE = (0.3, 0.6, 1.0, 1.5), (20.0, 30.0, 60.0, 100.0), (1.0, 5.0), (0.02, 0.1, 0.3)
#: Noise of a velocity where there is one, m/s.
DOPPLER = 0.04


@dataclass(frozen=True)
class Case:
    """One campaign: its vessel, its receiver, and whether there is a current."""

    number: int
    vessel: str
    size: float
    time: float
    rate: float
    white: float
    current: bool


def drawn(count: int, seed: int) -> list[Case]:
    """Draw so many campaigns."""
    rng, names = np.random.default_rng(seed), list(VESSELS)
    return [
        Case(
            k, names[(k // 2) % len(names)], *(float(rng.choice(x)) for x in (SIZES, TIMES, RATES, WHITE)), k % 2 == 1
        )
        for k in range(count)
    ]  # fmt: skip


def answer(case: Case, smooth: bool = False) -> tuple[Case, str]:
    """What is said of a campaign; of a receiver that filters: its positions wander smoothly, its velocities do not."""
    from seatrial import load_campaign, run

    ship, rng = make_vessel(case.vessel), np.random.default_rng(case.number)
    flow = {"speed": CURRENT * ship.speed, "direction": float(rng.uniform(0.0, 2.0 * np.pi))}
    receiver = Sensor(case.rate, case.white, 0.004, wander=case.size, wander_time=case.time, lost=0.01)
    sensors = dataclasses.replace(DEFAULT_SUITE, position=receiver)
    if smooth:
        filtered = dataclasses.replace(receiver, smooth=True)
        sensors = dataclasses.replace(sensors, position=filtered, velocity=Sensor(case.rate, DOPPLER))
    suite = FORMATS["csv"].suite(sensors)
    world = World((Effect("current", flow),) if case.current else ())
    runs = record_campaign(
        ship, world, suite, MANOEUVRES, duration=DURATION, seed=100 + case.number, validate=2
    )
    with tempfile.TemporaryDirectory() as place:
        found = run(load_campaign(write_campaign(Path(place) / "campaign", ship, runs, "csv"))).diagnosis
    assert found is not None
    return case, " ".join([found.verdict.name.lower(), *(e.fitted.name for e in found.effects)])


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw, run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bench_wander", description=__doc__)
    parser.add_argument("--cases", type=int, default=28)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--smooth", action="store_true", help="positions that wander smoothly, beside velocities"
    )
    a = parser.parse_args(arguments)
    print("vessel      wander m over s  per s  white m  lacks     said")
    right: dict[bool, list[bool]] = {False: [], True: []}
    with get_context("spawn").Pool(a.workers) as pool:
        for case, said in pool.imap(partial(answer, smooth=a.smooth), drawn(a.cases, a.seed)):
            lacks = "current" if case.current else "nothing"
            receiver = f"{case.size:9.1f} {case.time:6.0f} {case.rate:6.0f} {case.white:8.2f}"
            print(f"{case.vessel:10} {receiver}  {lacks:8}  {said}", flush=True)
            right[case.current].append(said == ("explained current" if case.current else "adequate"))
    for current, found in right.items():
        print(f"{'current named' if current else 'adequate'}: {sum(found)} of {len(found)}")


if __name__ == "__main__":
    main()
