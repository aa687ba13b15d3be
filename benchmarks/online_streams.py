"""Streams of a vessel under way, simulated: long random manoeuvring, with a world that changes on the way."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fixtures import effects as fx
from fixtures.campaign import Run, write_campaign
from fixtures.dynamics import STEP, integrate
from fixtures.effects import World
from fixtures.manoeuvres import make_manoeuvre, program
from fixtures.sensors import Recording, Sensor, Suite, sense
from fixtures.simulator import Truth
from fixtures.vessels import Vessel, actuator_table, make_vessel
from fixtures.writers.formats import FORMATS, fitted
from seatrial.capture.recording_file import Message, RecordingFile
from seatrial.capture.records import ChannelSpec

SUITE = Suite(
    position=Sensor(5.0, 0.02, 0.003, gap_every=120.0, gap_length=1.0, outliers=0.003, outlier_size=3.0),
    heading=Sensor(10.0, 0.006, 0.002, outliers=0.001, outlier_size=0.5),
    yaw_rate=Sensor(10.0, 0.003, 0.002),
)
#: The helm's steps, of the integrator's.
HELM_STEPS = 10

Change = tuple[float, World]


def sailed(
    vessel: Vessel, changes: Sequence[Change], duration: float, seed: int, manoeuvre: str = "random"
) -> Truth:
    """A long run in which the world becomes another at given times (the first at 0)."""
    plan = make_manoeuvre(manoeuvre, vessel, duration, seed)
    rows = program(plan, vessel)
    table, azimuth_of = actuator_table(vessel)
    times = np.arange(round(duration / STEP) + 1) * STEP
    edges = [HELM_STEPS * round(t / STEP / HELM_STEPS) for t, _ in changes] + [len(times) - 1]
    state = np.zeros(11)
    state[3] = vessel.speed
    parts = []
    for (_, world), a, b in zip(changes, edges[:-1], edges[1:], strict=True):
        parts.append(_part(vessel, world, state, times[a : b + 1], rows, table, azimuth_of, seed))
        state = parts[-1][0][-1].copy()
    ends = [-1] * (len(parts) - 1) + [None]
    joined = [np.concatenate([p[k][:e] for p, e in zip(parts, ends, strict=True)]) for k in range(4)]
    states, logged, actual, ground = joined
    x, y, psi, u_w, v_w, r = states[:, :6].T
    u = ground[:, 0] * np.cos(psi) + ground[:, 1] * np.sin(psi)
    v = -ground[:, 0] * np.sin(psi) + ground[:, 1] * np.cos(psi)
    columns = (times, x, y, psi, u, v, r, u_w, v_w, logged, actual, np.zeros((len(times), 2)))
    return Truth(vessel, plan, changes[0][1], 0, 0.0, *columns)


def _part(vessel, world, state, span, rows, table, azimuth_of, seed):  # noqa: ANN001, ANN202
    rng = np.random.default_rng([seed, 11])
    states, logged, actual, ground = integrate(
        vessel.hull, fx.pack(world, 0, 0.0), state, span, rows, table, azimuth_of,
        fx.pack_actuators(world, vessel, 0), HELM_STEPS, False,
        fx.thrust_factors(world, vessel, 0, span, rng), fx.wind_series(world, 0, span, rng),
        fx.wave_series(world, 0, span, rng), fx.flow_series(world, 0, span, 0.0),
    )  # fmt: skip
    if not np.isfinite(states).all():
        raise ValueError(f"{vessel.name} left the range of its equations")
    return states, logged, actual, ground


def recorded(truth: Truth, seed: int, suite: Suite = SUITE) -> Recording:
    """What the sensors make of it."""
    return sense(truth, dataclasses.replace(suite, antenna=truth.vessel.antenna), seed)


def vessel_for(name: str, form: str) -> Vessel:
    """A vessel as a format can log it."""
    found = fitted(make_vessel(name), FORMATS[form])
    if found is None:
        raise ValueError(f"{form} has no messages for the inputs of {name}")
    return found


def written(folder: Path, recording: Recording, form: str = "nmea0183", name: str = "stream") -> Path:
    """A campaign of one log in a folder; the path of its ``campaign.toml``."""
    run = Run(name, "identify", recording.truth.manoeuvre.kind, recording)
    return write_campaign(folder, recording.truth.vessel, [run], form)


def as_port(nmea: Path, out: Path, name: str = "gps") -> None:
    """NMEA text with the host's stamps as the capture of a port, a piece per line."""
    spec = ChannelSpec(f"/raw/{name}", "raw", metadata=(("protocol", "nmea"), ("baud", "115200")))
    messages = []
    for line in nmea.read_bytes().splitlines(keepends=True):
        stamp, _, sentence = line.partition(b" ")
        second, _, rest = stamp.partition(b".")
        time_ns = int(second) * 1_000_000_000 + int(rest.ljust(9, b"0"))
        messages.append(Message(spec, time_ns, time_ns, sentence))
    file = RecordingFile(out)
    for i in range(0, len(messages), 200):
        file.append(messages[i : i + 200])
    file.finish()


def turned(speed: float, degrees: float) -> World:
    """A current towards a direction."""
    return World((fx.Effect("current", {"speed": speed, "direction": math.radians(degrees)}),))
