"""Effects between the logged input and the actuator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from itertools import combinations

from identify.actuator_dynamics import Before, deadband_neutral, displaced, first_order, play, rate_limited
from identify.effect import Acting, Effect, FloatArray, Parameter, Setting, Values, Variant
from identify.slowness import slower
from preprocess.vessel import Vessel

#: What makes thrust does nothing somewhere near its zero, or somebody would have seen it; an angle's zero is anywhere.
_NEAR_ZERO = {"propeller": 0.5, "thruster": 0.5, "tunnel": 0.5}


def _each(setting: Setting, *forms: dict[str, object]) -> list[Variant]:
    """Every input by itself, in some forms; and all of a kind, for what is made alike may be off alike."""
    ways = forms or ({},)
    kinds = [setting.of_kind(kind) for kind in dict.fromkeys(i.kind for i in setting.inputs)]
    alike = [Variant(kind[0], form, kind[1:]) for kind in kinds if len(kind) > 1 for form in ways]
    alone = [Variant(i.name, form) for i in setting.inputs for form in ways]
    return alone + [v for v in alike if v.options.get("form") != "play"]


def _late(most: float, vessel: Vessel) -> tuple[float, float]:
    """How late an actuator may be, s: as much more as the vessel is slower than a small boat."""
    return 0.0, most * slower(vessel.length)


ACTUATOR_LAG = Effect(
    "actuator_lag", "actuator",
    "T ȧ + a = input",
    "The actuator follows its command like a first-order system.",
    "Step the actuator and film it, or log its feedback.",
    "Fossen 2011, sec. 12.3",
    parameters=(Parameter("time_constant", "s", 0.1, starts=(0.2, 1.0, 5.0), within=partial(_late, 20.0)),),
    actuator=lambda p, a, dt, _, b: first_order(*a, dt, p["time_constant"], b.told, b.lasted, b.begin),
    lasting=lambda p, _: 3.0 * p["time_constant"],
    on_its_way=True,
    variants=_each,
)  # fmt: skip

ACTUATOR_DELAY = Effect(
    "actuator_delay", "actuator",
    "actuator(t) = input(t − delay)",
    "The actuator does what it is told some time later.",
    "Film a step beside the clock; look for queues and radio links between logger and actuator.",
    "Fossen 2011, sec. 12.3",
    parameters=(Parameter("delay", "s", 0.1, starts=(0.2, 0.8), within=partial(_late, 10.0)),),
    input_delay=lambda p: p["delay"],
    variants=_each,
)  # fmt: skip


#: A rate from which on nothing is limited.
UNLIMITED = 1e9


def _rate(p: Values) -> float:
    return p["rate"] if p["rate"] < UNLIMITED else math.inf


ACTUATOR_RATE_LIMIT = Effect(
    "actuator_rate_limit", "actuator",
    "|ȧ| ≤ rate",
    "The actuator moves no faster than its motor can.",
    "Time a hard-over to hard-over.",
    "SOLAS II-1/29; Fossen 2011, sec. 12.3",
    parameters=(
        Parameter("rate", "input's unit/s", 0.1, (1e-3, UNLIMITED), UNLIMITED, (0.08, 0.2, 0.4, 0.8), relative=True),
    ),
    actuator=lambda p, a, dt, _, b: rate_limited(*a, dt, _rate(p), b.told, b.lasted, b.begin),
    lasting=lambda p, change: change / p["rate"],
    on_its_way=True,
    variants=_each,
)  # fmt: skip


def _deadband(p: Values, command: Acting, _: float, options: Mapping[str, object], before: Before) -> Acting:
    if options["form"] == "play":
        out, more = play(*command, p["width"], before.begin, before.told)
    else:
        out, more = deadband_neutral(*command, p["width"], options.get("shape") == "shifted")
    return out, more


#: Backlash; no response near zero and as commanded outside; the same with what is lost near zero lost everywhere.
_FORMS: tuple[dict[str, object], ...] = (
    {"form": "play"},
    {"form": "neutral"},
    {"form": "neutral", "shape": "shifted"},
)

ACTUATOR_DEADBAND = Effect(
    "actuator_deadband", "actuator",
    "play: a follows within ± width; neutral: a = 0 for |input| ≤ width, and outside the input, or (shifted) the input "
    "less ± width",
    "Backlash in the linkage, or no response near zero.",
    "Move the actuator by hand; small steps to both sides.",
    "Fossen 2011, sec. 12.3",
    parameters=(
        Parameter(
            "width", "input's unit", 0.02, (0.0, math.inf), starts=(0.06, 0.25), relative=True, believed=_NEAR_ZERO
        ),
    ),
    actuator=_deadband,
    begins=lambda o: o["form"] == "play",
    stepwise=lambda o: o["form"] == "neutral" and o.get("shape") != "shifted",
    bends=lambda o: o["form"] == "neutral",
    variants=lambda s: _each(s, *_FORMS),
)  # fmt: skip

ACTUATOR_OFFSET = Effect(
    "actuator_offset", "actuator",
    "a = input + offset",
    "The actuator's zero is not where the log has it.",
    "Line the rudder or the thruster up by eye at zero command; trim of the controller.",
    "Fossen 2011, sec. 12.3",
    parameters=(Parameter("offset", "input's unit", 0.05, relative=True, believed=_NEAR_ZERO),),
    actuator=lambda p, a, *_: displaced(*a, p["offset"]),
    bends=lambda _: True,
    variants=lambda s: [Variant(i.name) for i in s.inputs],  # each is trimmed by itself
)  # fmt: skip


def _rewire(options: Mapping[str, object], series: dict[str, FloatArray]) -> dict[str, FloatArray]:
    out = dict(series)
    swapped = options.get("swapped")
    if isinstance(swapped, tuple):
        a, b = swapped
        out[a], out[b] = series[b], series[a]
    for name in options.get("reversed", ()):  # type: ignore[attr-defined]
        out[name] = -out[name]
    return out


def _wirings(setting: Setting) -> list[Variant]:
    """Swapped pairs of one kind, each input reversed (a rudder's sign is the log's own), and pairs reversed."""
    movers = [i for i in setting.inputs if i.kind != "rudder"]
    found = [Variant(options={"reversed": (i.name,)}) for i in movers]
    for a, b in combinations(movers, 2):
        if a.kind == b.kind:
            found.append(Variant(options={"swapped": (a.name, b.name)}))
            found.append(Variant(options={"reversed": (a.name, b.name)}))
            found.append(Variant(options={"swapped": (a.name, b.name), "reversed": (a.name, b.name)}))
    return found


INPUT_WIRING = Effect(
    "input_wiring", "actuator",
    "inputs exchanged, or their sign reversed",
    "Two inputs are in each other's place in the log, or one acts backwards.",
    "Command one actuator at a time and look; the order of the channels in the autopilot's set-up.",
    "field practice",
    rewire=_rewire,
    variants=_wirings,
)  # fmt: skip
