"""From actuators to channels: what the inputs do, by kind and geometry."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce

import numpy as np

from preprocess.vessel import Input

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Series = Mapping[str, FloatArray]
#: Force along x, along y and moment about z.
Pushes = tuple[FloatArray, FloatArray, FloatArray]

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


def _pushes(item: Input, series: Series, inputs: tuple[Input, ...]) -> Pushes:
    """Force along x, along y and moment about z of one input, up to its gain."""
    azimuth = azimuth_of(inputs).get(item.name)
    x, y = item.position
    if item.kind == "rudder":
        side = series[item.name]
        return np.zeros_like(side), side, x * side
    force = series[f"thrust {item.name}"]
    if item.kind == "tunnel":
        return np.zeros_like(force), force, x * force
    if azimuth is None:
        return force, np.zeros_like(force), -y * force
    if item.position == (0.0, 0.0):
        x, y = azimuth.position
    along, across = force * np.cos(series[azimuth.name]), force * np.sin(series[azimuth.name])
    return along, across, x * across - y * along


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


def channels(names: tuple[str, ...], inputs: tuple[Input, ...], series: Series, n: int) -> FloatArray:
    """Channels (n, len(names)) from the actuators' series and their thrusts (``"thrust NAME"``)."""
    out = np.empty((n, len(names)))
    kinds = groups(inputs)
    pushing = {which for axis, _, which in (name.partition(":") for name in names) if axis in tuple("TFN")}
    pushes = {kind: [_pushes(item, series, inputs) for item in kinds[kind]] for kind in pushing}
    for k, name in enumerate(names):
        out[:, k] = _channel(name, kinds, pushes, series, n)
    return out


def _channel(
    name: str, kinds: Mapping[str, list[Input]], pushes: Mapping[str, list[Pushes]], series: Series, n: int
) -> FloatArray:
    if name in _SIMPLE:
        return _SIMPLE[name](kinds, series, n)
    if name.startswith("="):
        return series[name]
    axis, which = name.split(":", 1)
    if axis == "P":
        return series[f"thrust {which}"]
    place = "TFN".index(axis)
    return _sum([push[place] for push in pushes[which]])


def _sum(series: Sequence[FloatArray]) -> FloatArray:
    """Sum of some series (n,); of one, that one."""
    return reduce(np.add, series)


def _mean(series: Sequence[FloatArray]) -> FloatArray:
    """Mean of some series (n,); of one, that one."""
    return series[0] if len(series) == 1 else _sum(series) / len(series)


def _screws(kinds: Mapping[str, list[Input]]) -> list[Input]:
    return kinds.get("propeller") or kinds.get("thruster") or []


def _mean_rudder(kinds: Mapping[str, list[Input]], series: Series, _: int) -> FloatArray:
    return _mean([series[i.name] for i in kinds["rudder"]])


def _revolutions(item: Input, force: FloatArray) -> FloatArray:
    """Revolutions that give a thrust, so that what acts on the thrust acts on them."""
    return force if item.law == "linear" else np.sign(force) * np.sqrt(np.abs(force))


_SIMPLE: dict[str, Callable[[Mapping[str, list[Input]], Series, int], FloatArray]] = {
    "−": lambda k, s, n: np.full(n, -1.0),
    "δ": _mean_rudder,
    "|δ|": lambda k, s, n: np.abs(_mean_rudder(k, s, n)),
    "n": lambda k, s, n: _mean([_revolutions(i, s[f"thrust {i.name}"]) for i in _screws(k)]),
    "|n|n": lambda k, s, n: _sum([s[f"thrust {i.name}"] for i in _screws(k)]),
    "|n|": lambda k, s, n: _sum([np.abs(s[i.name]) for i in _screws(k)]),
}
