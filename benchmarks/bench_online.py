"""Identification while sailing, on simulated streams: accuracy, false alarms, changes noticed and named, speed.

    python -m benchmarks.bench_online                     # a taste, some minutes
    python -m benchmarks.bench_online --hours 10 --seeds 6

*Accuracy*: the squared error of the coefficients, in the metric of a fit to four times the data, of the off-line fit to
T seconds and of the on-line estimate after T, 2 T and 3 T of the same stream; and how far apart the two are at the end.
*False alarms*: hours of manoeuvring in which nothing happens. *Changes*: something sets in half way; how much it raises
the ten-second prediction error, after how long it is noticed, and what it is called. *Speed*: samples per second of
processor time, on one core.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

from benchmarks.online_changes import KINDS, Noticed, change
from benchmarks.online_runs import CALM, FLEET, identified, offline, stream
from fixtures.sensors import Sensor, Suite
from seatrial.online.identifier import Identifier
from seatrial.online.recorded import batches
from seatrial.online.updates import Note

# --- accuracy ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Accuracy:
    """Errors per coefficient, in the metric of the reference: (off line, on line after T, 2 T, 3 T), and agreement."""

    vessel: str
    seed: int
    off: float
    on: tuple[float, float, float]
    agreement: float
    worst: float


def accuracy(task: tuple[str, str, int, float]) -> Accuracy:
    """One stream."""
    vessel, form, seed, seconds = task
    campaign, log = stream(vessel, form, [(0.0, CALM)], 4.0 * seconds, seed)
    best, covariance, names = offline(campaign, log, 4.0 * seconds)
    own = [k for k, n in enumerate(names) if n != "input_lead"]
    metric = np.linalg.inv(covariance[np.ix_(own, own)])
    kept = [names[k] for k in own]

    def error(p: dict[str, float]) -> float:
        off = np.array([p[n] - best[n] for n in kept])
        return float(np.sqrt(off @ metric @ off / len(kept)))

    plain, spread, _ = offline(campaign, log, seconds)
    found = []
    for share in (1.0, 2.0, 3.0):
        identifier, _ = identified(campaign, log, share * seconds)
        assert identifier.estimator is not None
        found.append(dict(zip(names, identifier.estimator.known.p, strict=True)))
    sd = np.sqrt(np.diag(spread))[own]
    apart = np.abs(np.array([found[0][n] - plain[n] for n in kept])) / sd
    return Accuracy(
        vessel, seed, error(plain), (error(found[0]), error(found[1]), error(found[2])),
        float(np.mean(apart < 2.0)), float(apart.max()),
    )  # fmt: skip


# --- false alarms -----------------------------------------------------------------------------------------


def quiet(task: tuple[str, str, int, float]) -> tuple[float, list[str]]:
    """Seconds without any change, and the alarms in them."""
    vessel, form, seed, seconds = task
    campaign, log = stream(vessel, form, [(0.0, CALM)], seconds, seed)
    identifier, updates = identified(campaign, log)
    assert identifier.estimator is not None
    return seconds, [
        f"{vessel} {seed}: {u.t:.0f} s {u.text}" for u in updates if isinstance(u, Note) and u.warning
    ]


# --- speed ------------------------------------------------------------------------------------------------

FAST = Suite(
    position=Sensor(200.0, 0.02, 0.0005), heading=Sensor(300.0, 0.006, 0.0003), yaw_rate=Sensor(300.0, 0.003, 0.0003),
    input_rate=100.0,
)  # fmt: skip


def speed(seconds: float) -> tuple[float, float, float]:
    """Samples per second of the stream, per second of processor time, and the longest pause, s."""
    campaign, log = stream("usv", "nmea0183", [(0.0, CALM)], seconds, 1, FAST)
    identifier = Identifier(campaign)
    longest, began, first = 0.0, time.process_time(), None
    for tables in batches(log):
        before = time.process_time()
        list(identifier.feed("log", tables))
        if first is None and identifier.estimator is not None:
            first = time.process_time() - began
            continue
        longest = max(longest, time.process_time() - before)
    used = time.process_time() - began
    return identifier.samples / seconds, identifier.samples / used, longest


# --- all --------------------------------------------------------------------------------------------------


def main() -> None:
    """Run what is asked for, and print it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--parts", default="accuracy,alarms,changes,speed")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--hours", type=float, default=0.5, help="of streams in which nothing happens")
    parser.add_argument("--seconds", type=float, default=100.0, help="T of the accuracy")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    parts = options.parts.split(",")
    with ProcessPoolExecutor(options.workers) as pool:
        if "accuracy" in parts:
            tasks = [(v, f, s, options.seconds) for s in range(options.seeds) for v, f in FLEET]
            print_lines(accuracy_lines(pool.map(accuracy, tasks)))
        if "alarms" in parts:
            count = max(1, math.ceil(options.hours / 0.5))
            runs = [(*FLEET[k % len(FLEET)], 100 + k, 3600.0 * options.hours / count) for k in range(count)]
            print_lines(alarm_lines(pool.map(quiet, runs)))
        if "changes" in parts:
            cases = [
                (k, v, f, size, 10 * s + k, 240.0 + 3.7 * s + k, 130.0)
                for k, kind in enumerate(KINDS) for size in kind.sizes for v, f in FLEET for s in range(options.seeds)
            ]  # fmt: skip
            print_lines(change_lines(pool.map(change, cases)))
    if "speed" in parts:
        rate, fast, longest = speed(120.0)
        print(
            f"\nspeed: a stream of {rate:.0f} samples/s goes through at {fast:,.0f} samples/s on one core, first fit"
        )
        print(f"included; the longest pause after that is {longest:.2f} s of processor time")


def print_lines(lines: Iterator[str]) -> None:
    """A blank line, and the lines."""
    print()
    for line in lines:
        print(line, flush=True)


def accuracy_lines(come: Iterable[Accuracy]) -> Iterator[str]:
    """Accuracy as a table, row by row."""
    yield "| vessel | seed | off line, T | on line, T | 2 T | 3 T | within 2 σ of off line | worst, σ |"
    yield "|---|---|---|---|---|---|---|---|"
    found = []
    for a in come:
        found.append(a)
        on = " | ".join(f"{x:.2f}" for x in a.on)
        yield f"| {a.vessel} | {a.seed} | {a.off:.2f} | {on} | {a.agreement:.0%} | {a.worst:.1f} |"
    good = [a.on[2] <= a.off for a in found]
    yield f"on line with 3 T no worse than off line with T: {sum(good)} of {len(good)}"


def alarm_lines(found: Iterable[tuple[float, list[str]]]) -> Iterator[str]:
    """False alarms, after every stream."""
    hours, count = 0.0, 0
    for seconds, lines in found:
        said = [line for line in lines if "stopped fitting" in line]
        hours, count = hours + seconds / 3600.0, count + len(said)
        yield from (f"  {line}" for line in said)
        yield f"false alarms: {count} in {hours:.1f} h of manoeuvring"


def change_lines(come: Iterable[Noticed]) -> Iterator[str]:
    """Changes as a table, row by row."""
    yield "| change | vessel | size | 10-s error | noticed after | named | right |"
    yield "|---|---|---|---|---|---|---|"
    found = []
    for n in come:
        found.append(n)
        delay = f"{n.delay:.0f} s" if np.isfinite(n.delay) else "not"
        named = ", ".join(n.named) or ("nothing known" if np.isfinite(n.delay) else "")
        row = f"{n.kind} | {n.vessel} | {n.size:g} | × {n.ratio:.2f} | {delay} | {named} | {'yes' if n.right else 'no'}"
        yield f"| {row} |"
    raised = [n for n in found if n.ratio >= 1.5]
    soon = [n for n in raised if n.delay <= 20.0]
    yield f"of {len(raised)} that raise the ten-second error by half or more, {len(soon)} are noticed within 20 s"
    late = [n for n in found if np.isfinite(n.delay)]
    yield f"of {len(late)} noticed, {sum(n.right for n in late)} are rightly named (alone or among look-alikes)"
    yield f"alarms before the change: {sum(n.early for n in found)}"


if __name__ == "__main__":
    main()
