"""What the symbols of the equations stand for aboard this vessel: inputs by name, levers in metres, units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from identify.fit import Fit
from identify.forces import azimuth_of, groups
from identify.term import factors_of
from preprocess.columns import input_unit
from preprocess.vessel import Input
from validate.report.effect_terms import texts
from validate.report.words import joined, number

#: Symbols that mean the same aboard every vessel, with the factors that they are made of.
GENERAL = (
    ("U", {"U", "/U"}, "√(u² + v²), m/s"),
    ("Δu", {"Δu"}, "u less the speed that the model is about, m/s"),
    ("e1, e2", {"e1", "e2"}, "states of the model's own"),
    ("Vwx, Vwy", {"Vwx", "Vwy"}, "speed of the air past the hull times its part forward, to starboard, m²/s²"),
    ("T_P", {"T_P"}, "thrust of the propeller per mass, m/s²"),
    ("F_N", {"F_Nsinδ", "F_Ncosδ"}, "normal force of the rudder per mass, m/s²"),
)  # fmt: skip
MOTION = (
    "u, v, r",
    "surge and sway speed, m/s, positive forward and to starboard, and yaw rate, rad/s, to starboard",
)


def legend(fit: Fit) -> list[tuple[str, str]]:
    """Symbol and meaning of everything that stands in the equations of a fit."""
    used = {f for t in texts(fit) for f in factors_of(t)}
    general = [(symbol, words) for symbol, of, words in GENERAL if of & used]
    return [MOTION, *general, *_of_angles(fit.inputs, used), *_of_forces(fit.inputs, used)]


def _of_angles(inputs: Sequence[Input], used: set[str]) -> Iterator[tuple[str, str]]:
    """Mean rudder, revolutions, and the thrust of one input."""
    kinds = groups(tuple(inputs))
    if {"δ", "|δ|"} & used:
        names = [i.name for i in kinds.get("rudder", ())]
        yield "δ", ("mean of " if len(names) > 1 else "") + f"{joined(names)}, rad, its sign the log's own"
    screws = kinds.get("propeller") or kinds.get("thruster") or []
    if {"|n|n", "|n|"} & used and screws:
        added = ", added up" if len(screws) > 1 else ""
        yield "n", f"{joined(i.name for i in screws)}, {_unit(screws[0])}{added}"
    for item in inputs:
        if f"P:{item.name}" in used:
            yield f"P:{item.name}", f"{_thrust(item)}, {_unit(item)}"


def _of_forces(inputs: Sequence[Input], used: set[str]) -> Iterator[tuple[str, str]]:
    """Thrust, side force and moment of every kind, up to the gain that is their coefficient."""
    for kind, members in groups(tuple(inputs)).items():
        for letter, what in (("T", "thrust"), ("F", "side force"), ("N", "moment")):
            if (symbol := f"{letter}:{kind}") in used:
                parts = [part for i in members if (part := _part(letter, i, tuple(inputs)))]
                yield symbol, f"{what}: {_sum(parts)}; {_unit(members[0])}"


def _part(letter: str, item: Input, inputs: tuple[Input, ...]) -> str:
    """What one input puts in, as ``identify.forces`` has it; nothing where its lever is none."""
    x, y = item.position
    azimuth = azimuth_of(inputs).get(item.name)
    if azimuth is not None:
        x, y = (x, y) if (x, y) != (0.0, 0.0) else azimuth.position
        lever = {"T": "cos α", "F": "sin α", "N": f"({number(x)} sin α {_signed(-y)} cos α) m"}[letter]
        return f"{lever} × {_thrust(item)}, α being {azimuth.name}"
    if letter != "N":
        return _thrust(item)
    lever_arm = x if item.kind in ("rudder", "tunnel") else -y
    return f"{number(lever_arm)} m × {_thrust(item)}" if lever_arm else ""


def _signed(value: float) -> str:
    return f"{'−' if value < 0 else '+'} {number(abs(value))}"


def _sum(parts: Sequence[str]) -> str:
    return " + ".join(parts).replace("+ −", "− ")


def _thrust(item: Input) -> str:
    """The command by which an input's force goes: an angle, or c|c|, or c where its law is linear."""
    plain = item.kind == "rudder" or item.law == "linear"
    return item.name if plain else f"{item.name}·|{item.name}|"


def _unit(item: Input) -> str:
    """In what an input is measured."""
    unit = input_unit(item)
    return f"{item.kind} from −1 to 1" if unit == "1" else f"{item.kind} in {unit}"
