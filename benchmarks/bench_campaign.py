"""``python -m benchmarks.bench_campaign``: whole campaigns of eight logs and twenty minutes, from bytes to report.

Each is drawn by the simulator, and ``seatrial run`` reads it in a process of its own: reading, smoothing, fitting,
diagnosing, report, recording and tables, by the clock and in seconds of processor. The second run of a campaign counts,
for the first may compile.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from fixtures.campaign import DEFAULT_SUITE, FORMATS, record_campaign, write_campaign
from fixtures.effects import Effect, World
from fixtures.vessels import make_vessel

MANOEUVRES = ("zigzag", "circle", "random", "spiral", "zigzag10", "pull_out", "random", "zigzag")
#: Length of a log, s: eight make twenty minutes.
DURATION = 150.0
#: Vessel, format, and what the declared model lacks.
CASES: tuple[tuple[str, str, tuple[Effect, ...]], ...] = (
    ("usv", "nmea0183", ()),
    ("catamaran", "tlog", ()),
    ("usv", "mcap", (Effect("current", {"speed": 0.25, "direction": 2.0}),)),
    ("catamaran", "dataflash", (Effect("actuator_delay", {"delay": 0.3}, "left"),)),
    ("patrol", "candump", (Effect("heading_bias", {"bias": 0.08}),)),
)


def made(folder: Path, vessel: str, form: str, effects: tuple[Effect, ...], seed: int) -> Path:
    """Draw a campaign; return its ``campaign.toml``."""
    ship, suite = make_vessel(vessel), FORMATS[form].suite(DEFAULT_SUITE)
    runs = record_campaign(ship, World(effects), suite, MANOEUVRES, duration=DURATION, seed=seed, validate=2)
    return write_campaign(folder, ship, runs, form)


def timed(campaign: Path) -> tuple[float, float]:
    """Seconds by the clock and of processor of one ``seatrial run``."""
    command = [
        sys.executable,
        "-m",
        "seatrial",
        "run",
        str(campaign),
        "--out",
        str(campaign.parent / "results"),
    ]
    begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - begin, spent


def verdict_of(campaign: Path) -> str:
    """What the report says of a campaign."""
    report = json.loads((campaign.parent / "results" / "report.json").read_text(encoding="utf-8"))
    found = report["diagnosis"]
    named = ", ".join(e["name"] for e in found["effects"])
    return f"{found['verdict']} {named}".strip()


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw, run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bench_campaign", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    seed = parser.parse_args(arguments).seed
    print("vessel      format      lacks            clock s  processor s  bytes, MB  verdict")
    for vessel, form, effects in CASES:
        with tempfile.TemporaryDirectory() as place:
            campaign = made(Path(place) / "campaign", vessel, form, effects, seed)
            size = sum(f.stat().st_size for f in campaign.parent.iterdir()) / 1e6
            clock, spent = [timed(campaign) for _ in range(2)][-1]
            lacks = ", ".join(e.name for e in effects) or "nothing"
            print(
                f"{vessel:11} {form:11} {lacks:16} {clock:7.1f} {spent:12.1f} {size:10.1f}  {verdict_of(campaign)}",
                flush=True,
            )


if __name__ == "__main__":
    main()
