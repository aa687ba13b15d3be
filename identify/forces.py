"""From actuators to channels: what the inputs do, by kind and geometry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial, reduce

import numpy as np

from identify.turned import turned
from preprocess.vessel import Input

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Series = Mapping[str, FloatArray]
#: Force along x, along y and moment about z.
Pushes = tuple[FloatArray, FloatArray, FloatArray]
#: What some inputs put into each channel, made when it is asked for.
Shares = dict[str, Callable[[], FloatArray]]

#: Kinds that give thrust.
THRUSTING = ("propeller", "thruster", "tunnel")


def thrust(item: Input, series: FloatArray) -> FloatArray:
    """Thrust of an input, up to its gain: c|c|, or c where its law is linear."""
    return series if item.law == "linear" else series * np.abs(series)


def azimuth_of(inputs: tuple[Input, ...]) -> dict[str, Input]:
    """Name of each driven propeller, with the azimuth that turns it."""
    return {i.drives: i for i in inputs if i.kind == "azimuth" and i.drives}


def groups(inputs: tuple[Input, ...]) -> dict[str, list[Input]]:
    """Inputs that share a gain, by kind."""
    kinds: dict[str, list[Input]] = {}
    for item in inputs:
        if item.kind in (*THRUSTING, "rudder"):
            kinds.setdefault(item.kind, []).append(item)
    return kinds


def _pushes(item: Input, series: Series, azimuth: Input | None) -> Pushes:
    """Force along x, along y and moment about z of one input that gives thrust, up to its gain."""
    x, y = item.position
    force = series[f"thrust {item.name}"]
    if item.kind == "tunnel":
        return np.zeros_like(force), force, x * force
    if azimuth is None:
        return force, np.zeros_like(force), -y * force
    if item.position == (0.0, 0.0):
        x, y = azimuth.position
    along, across, moment = turned(force, series[azimuth.name], (x, y))
    return along, across, moment


def together(inputs: tuple[Input, ...]) -> tuple[tuple[Input, ...], ...]:
    """Inputs whose doings cannot be told apart: all rudders; each that gives thrust, with the azimuth that turns it."""
    azimuths = azimuth_of(inputs)
    thrusting = [i for i in inputs if i.kind in THRUSTING]
    rudders = tuple(i for i in inputs if i.kind == "rudder")
    alone = [(i, azimuths[i.name]) if i.name in azimuths else (i,) for i in thrusting]
    return (rudders, *alone) if rudders else tuple(alone)


def channel_names(inputs: tuple[Input, ...]) -> tuple[str, ...]:
    """Channels that a vessel with these inputs has."""
    kinds = groups(inputs)
    names = ["−"]
    if "rudder" in kinds:
        names += ["δ", "|δ|"]
    if "propeller" in kinds or "thruster" in kinds:
        names += ["n", "|n|n", "|n|"]
    names += [f"P:{i.name}" for i in inputs if i.kind in ("propeller", "thruster")]
    azimuthed = azimuth_of(inputs)
    for kind, members in kinds.items():
        turned = any(m.name in azimuthed for m in members)
        if kind in ("propeller", "thruster"):
            names.append(f"T:{kind}")
        if kind in ("tunnel", "rudder") or turned:
            names.append(f"F:{kind}")
        if turned or any(m.position[0 if kind in ("tunnel", "rudder") else 1] != 0.0 for m in members):
            names.append(f"N:{kind}")
    return tuple(names)


def shares(
    names: tuple[str, ...], inputs: tuple[Input, ...], unit: tuple[Input, ...], series: Series
) -> tuple[tuple[int, ...], FloatArray]:
    """Places of the channels that inputs of one unit (see ``together``) drive, and what they put in (k, n)."""
    found = _of_rudders(unit, series) if unit[0].kind == "rudder" else _of_thrust(unit, inputs, series)
    places = tuple(k for k, name in enumerate(names) if name in found)
    rows = [found[names[k]]() for k in places]
    return places, np.array(rows) if rows else np.zeros((0, len(series[unit[0].name])))


def _of_rudders(unit: tuple[Input, ...], series: Series) -> Shares:
    mean = reduce(np.add, [series[i.name] for i in unit]) / len(unit)
    return {
        "δ": lambda: mean,
        "|δ|": lambda: np.abs(mean),
        "F:rudder": lambda: mean * len(unit),
        "N:rudder": lambda: reduce(np.add, [i.position[0] * series[i.name] for i in unit]),
    }


def _of_thrust(unit: tuple[Input, ...], inputs: tuple[Input, ...], series: Series) -> Shares:
    item = unit[0]
    force, pushes = series[f"thrust {item.name}"], _pushes(item, series, unit[1] if len(unit) > 1 else None)
    found: Shares = {f"{a}:{item.kind}": partial(_itself, p) for a, p in zip("TFN", pushes, strict=True)}
    found[f"P:{item.name}"] = lambda: force
    if item in (screws := _screws(inputs)):
        found["n"] = lambda: _revolutions(item, force) / len(screws)
        found["|n|n"] = lambda: force
        found["|n|"] = lambda: np.abs(series[item.name])
    return found


def _itself(values: FloatArray) -> FloatArray:
    return values


@cache
def _screws(inputs: tuple[Input, ...]) -> tuple[Input, ...]:
    kinds = groups(inputs)
    return tuple(kinds.get("propeller") or kinds.get("thruster") or ())


def _revolutions(item: Input, force: FloatArray) -> FloatArray:
    """Revolutions that give a thrust, so that what acts on the thrust acts on them."""
    return force if item.law == "linear" else np.sign(force) * np.sqrt(np.abs(force))
