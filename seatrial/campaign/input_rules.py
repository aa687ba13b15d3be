"""What an input must be beyond the types of its keys."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise

from preprocess.signals import VOCABULARY
from seatrial.campaign.faults import Fault, found, nearest_one
from seatrial.campaign.tables import CampaignTable, InputTable
from seatrial.names import GEOMETRIC_MODELS

Inputs = Mapping[str, InputTable]

#: Units of the logged values by kind of input.
UNITS: Mapping[str, tuple[str, ...]] = {
    "rudder": ("rad", "deg", "percent"),
    "azimuth": ("rad", "deg"),
    "propeller": ("rev/s", "rpm", "percent", "N"),
    "thruster": ("percent", "N", "rev/s", "rpm"),
    "tunnel": ("percent", "N", "rev/s", "rpm"),
}
#: Angles that a calibration goes to at most, rad: a turn of a rudder, some of an azimuth that counts them.
FARTHEST: Mapping[str, float] = {"rudder": 2.0 * math.pi, "azimuth": 8.0 * math.pi}
#: Kinds whose value makes thrust.
THRUST = ("propeller", "thruster", "tunnel")
#: Kinds that have no standard message to be found by.
NEEDS_SIGNAL = ("thruster", "azimuth", "tunnel")
#: Columns of the results that no input may have the name of.
RESERVED = frozenset(s.name for s in VOCABULARY) | {"utc_ns", "role"}
SUFFIXES = ("_measured", "_before", "_after")
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def input_faults(table: CampaignTable) -> Iterator[Fault]:
    """Faults of all inputs, and of their geometry where the model needs it."""
    if not table.inputs:
        yield Fault(("inputs",), "at least one actuator: a table [inputs.NAME]", "none")
    for name, declared in table.inputs.items():
        for key, expected, what, near in faults_of_input(name, declared, table.inputs):
            yield Fault(("inputs", name, *([key] if key else [])), expected, what, near)
    for name in without_position(table.model.name, table.inputs):
        expected = f"a position, which the model '{table.model.name}' needs ([m forward, m starboard])"
        yield Fault(("inputs", name, "position"), expected, "none")


KeyFault = tuple[str, str, str, str | None]


def faults_of_input(name: str, declared: InputTable, inputs: Inputs) -> Iterator[KeyFault]:
    """Faults of one input as (key, expected, found, nearest)."""
    yield from name_faults(name)
    yield from calibration_faults(declared)
    yield from unit_faults(declared)
    yield from azimuth_faults(name, declared, inputs)
    if declared.signal is None and declared.kind in NEEDS_SIGNAL:
        expected = f"TOPIC.FIELD: no message is standard for the kind '{declared.kind}'"
        yield "signal", expected, "none", None
    if declared.law is not None and declared.kind not in THRUST:
        yield (
            "law",
            f"no such key for the kind '{declared.kind}', which makes no thrust",
            found(declared.law),
            None,
        )


def name_faults(name: str) -> Iterator[KeyFault]:
    """An input's name is the name of a column."""
    if not NAME.fullmatch(name):
        yield "", "a name of letters, digits and underscores that begins with a letter", found(name), None
    elif name in RESERVED or name.endswith(SUFFIXES):
        yield "", "a name that no other column of the results has", found(name), None


def calibration_faults(declared: InputTable) -> Iterator[KeyFault]:
    """``pwm`` and ``value`` belong together, and to no unit."""
    pwm, value = declared.pwm, declared.value
    if pwm is None and value is None:
        return
    if pwm is None or value is None:
        absent, there = ("pwm", "value") if pwm is None else ("value", "pwm")
        yield absent, f"the other half of the calibration, as many numbers as in {there}", "none", None
        return
    if len(pwm) != len(value):
        yield "value", f"as many numbers as in pwm ({len(pwm)})", f"{len(value)}", None
    if not is_monotonic(pwm):
        yield "pwm", "numbers that only rise, or only fall", found(pwm), None
    most = max(map(abs, value))
    if most > FARTHEST.get(declared.kind, most):
        expected = f"the angles of this {declared.kind} in rad ({most:g}° are {math.radians(most):.4g} rad)"
        yield "value", expected, found(value), None
    if declared.unit is not None:
        yield (
            "unit",
            "either a unit or a calibration (pwm and value)",
            f"{found(declared.unit)} beside one",
            None,
        )


def is_monotonic(values: Sequence[float]) -> bool:
    """Whether values rise strictly, or fall strictly."""
    signs = {(b > a) - (b < a) for a, b in pairwise(values)}
    return signs in ({1}, {-1})


def unit_faults(declared: InputTable) -> Iterator[KeyFault]:
    """A unit must be one of its kind."""
    units = UNITS[declared.kind]
    if declared.unit is not None and declared.unit not in units:
        near = nearest_one(declared.unit, units)
        yield "unit", f"a unit of a {declared.kind} ({', '.join(units)})", found(declared.unit), near


def azimuth_faults(name: str, declared: InputTable, inputs: Inputs) -> Iterator[KeyFault]:
    """An azimuth turns the thrust of a propeller."""
    driven = [n for n, i in inputs.items() if i.kind in ("propeller", "thruster")]
    expected = f"the name of the propeller that it turns ({', '.join(driven) or 'none is declared'})"
    if declared.kind != "azimuth":
        if declared.drives is not None:
            yield (
                "drives",
                f"no such key for the kind '{declared.kind}', only for azimuth",
                found(declared.drives),
                None,
            )
    elif declared.drives is None:
        yield "drives", expected, "none", None
    elif declared.drives not in driven:
        yield "drives", expected, found(declared.drives), nearest_one(declared.drives, driven)
    elif any(i.drives == declared.drives for n, i in inputs.items() if n < name):
        yield "drives", "a propeller that no other azimuth turns", found(declared.drives), None


def without_position(model: str, inputs: Inputs) -> Iterable[str]:
    """Inputs that lack the position that a model needs: those whose place no convention tells.

    A rudder, or a single propeller, stands at the stern on the centre line where nothing else is said. Of an azimuth
    that drives nothing, and of what it may have been meant to drive, nothing is said beside that.
    """
    if model not in GEOMETRIC_MODELS:
        return []
    turned = {i.drives: i for i in inputs.values() if i.kind == "azimuth" and i.drives}
    propellers = [n for n, i in inputs.items() if i.kind == "propeller"]
    astray = any(i.kind == "azimuth" and i.drives not in inputs for i in inputs.values())

    def placed(name: str, declared: InputTable) -> bool:
        own = declared.position is not None
        if declared.kind == "azimuth":
            driven = inputs.get(declared.drives or "")
            return own or driven is None or driven.position is not None
        if name in turned:
            return own or turned[name].position is not None
        own = own or (astray and declared.kind in ("propeller", "thruster"))
        return own or declared.kind == "rudder" or (declared.kind == "propeller" and len(propellers) == 1)

    return [name for name, declared in inputs.items() if not placed(name, declared)]
