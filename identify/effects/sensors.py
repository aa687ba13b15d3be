"""Effects of sensors, clocks and loading."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

from identify.effect import Effect, Loading, Parameter, SensorShift, Setting, Values, Variant, read_as
from preprocess.vessel import Vessel

#: An antenna is within this share of the vessel's length from the origin, which may be at either end, and what a mast
#: or a boom reaches, m. It is so across the vessel, too: who takes forward for starboard errs by that much.
ABOARD, MAST = 1.0, 0.5

HEADING_BIAS = Effect(
    "heading_bias", "sensor",
    "logged ψ = ψ + bias",
    "The compass, or the two antennas, are not in line with the keel.",
    "Align along a quay of known bearing; run reciprocal courses.",
    "IMO MSC/Circ.1053; field practice",
    parameters=(Parameter("bias", "rad", 0.02, (-math.pi, math.pi)),),
    sensor=lambda p, _: SensorShift(heading_bias=p["bias"]),
)  # fmt: skip

GYRO_BIAS = Effect(
    "gyro_bias", "sensor",
    "logged r = scale · r + bias",
    "The rate gyro has a bias or a scale error.",
    "Log at rest for a minute; turn by a known angle.",
    "Groves 2013, sec. 4.4",
    parameters=(
        Parameter("bias", "rad/s", 0.005, (-1.0, 1.0)),
        Parameter("scale", "1", 0.02, (0.2, 5.0), null=1.0),
    ),
    sensor=lambda p, _: SensorShift(gyro_bias=p["bias"], gyro_scale=p["scale"] - 1.0),
    variants=lambda s: [Variant()] if "yaw_rate" in s.streams else [],
)  # fmt: skip


def _aboard(axis: int, vessel: Vessel) -> tuple[float, float]:
    """How far an antenna can be from where it is declared, along the vessel (0) or across it (1)."""
    reach = MAST + ABOARD * vessel.length
    return -reach - vessel.antenna[axis], reach - vessel.antenna[axis]


ANTENNA_OFFSET = Effect(
    "antenna_offset", "sensor",
    "logged position = position of the origin + R(ψ) (antenna + (x, y))",
    "The antenna is not where the campaign says it is.",
    "Measure the antenna from the origin, forward and to starboard.",
    "Groves 2013, sec. 3.4",
    # With the sway v + x r a hull's linear terms are as good: what is not linear tells x, and has several valleys.
    parameters=(
        Parameter("x", "m", 0.1, places=4, within=partial(_aboard, 0)),
        Parameter("y", "m", 0.1, within=partial(_aboard, 1)),
    ),
    sensor=lambda p, _: SensorShift(antenna=(p["x"], p["y"])),
    variants=lambda s: [Variant()] if "position" in s.streams else [],
)  # fmt: skip


def _sensor_streams(setting: Setting) -> list[Variant]:
    return [
        Variant(options={"stream": s}) for s in ("position", "heading", "yaw_rate") if s in setting.streams
    ]


#: Stamps are off by so much, s, in any logger: some hundred bytes take as long through a serial line, a message as long
#: in a queue, and a receiver as long over its solution.
ANY_LOGGERS = 0.02

CLOCK_OFFSET = Effect(
    "clock_offset", "clock",
    "stamp = true time + offset, for one stream",
    "One sensor's stamps are late or early: another clock, a filter's delay, a queue. A velocity has those of its "
    "receiver's position.",
    "Look up the sensor's latency; log a common event; use the receiver's own time.",
    "Groves 2013, sec. 14.4",
    parameters=(Parameter("offset", "s", 0.1, (-20.0, 20.0), slight=ANY_LOGGERS),),
    sensor=lambda p, o: SensorShift(clock={str(o["stream"]): p["offset"]}),
    variants=_sensor_streams,
)  # fmt: skip

CLOCK_OFFSET_INPUTS = Effect(
    "clock_offset", "clock",
    "stamp = true time + offset, for all inputs",
    "The inputs' stamps are late or early against the sensors'.",
    "Log a common event; look at the logger's queue.",
    "Groves 2013, sec. 14.4",
    parameters=(Parameter("offset", "s", 0.1, (-20.0, 20.0), starts=(0.25, -0.25, 1.0), slight=ANY_LOGGERS),),
    input_delay=lambda p: -p["offset"],
    variants=lambda s: [Variant(options={"stream": "inputs"})] if s.inputs else [],
)  # fmt: skip


def _other_load(setting: Setting) -> list[Variant]:
    """The later logs against the earlier ones, then one log against the others; a group and its complement are one."""
    logs = setting.logs
    known = set(setting.identify_logs or logs)
    found: dict[frozenset[str], tuple[str, ...]] = {}
    for group in [*(logs[k:] for k in range(1, len(logs))), *((name,) for name in logs)]:
        inside = frozenset(group) & known
        if inside and inside != known and frozenset(known - inside) not in found:
            found.setdefault(inside, group)
    return [Variant(options={"logs": group}) for group in found.values()]


def loading_of(values: Values, options: Mapping[str, object]) -> Loading:
    """Coriolis terms are inertial themselves, and stay; in the whole form the model's terms are forces, all of them.

    What other effects add is a force as well, or, in the apart forms, an acceleration that no load changes.
    """
    others, form = 1.0 / values["ratio"], str(options.get("form", ""))
    inertial, added = others if "whole" in form else 1.0, 1.0 if "apart" in form else None
    return Loading(inertial=inertial, others=others, added=added)


MASS_CHANGE = Effect(
    "mass_change", "loading",
    "u̇, v̇, ṙ × 1/ratio in the logs named, less Coriolis terms or (form whole) with them; what other effects add "
    "goes with it, or (forms apart, whole apart) stays",
    "The vessel was heavier or lighter in some of the logs.",
    "Load, fuel, flooding; draught marks before each run.",
    "Fossen 2011, sec. 3.3",
    parameters=(Parameter("ratio", "1", 0.1, (0.1, 10.0), null=1.0),),
    loading=loading_of,
    forms=read_as("whole", "apart", "whole apart"),
    variants=_other_load,
)  # fmt: skip
