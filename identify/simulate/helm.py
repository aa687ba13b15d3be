"""From helm and throttle to the vessel's inputs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identify.forces import azimuth_of
from ingest.errors import UsageError
from preprocess.vessel import Input

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Helm at which differential thrust stops the inner thruster.
HARD_OVER = math.radians(35.0)


@dataclass(frozen=True)
class Helm:
    """How a vessel is steered and driven.

    Attributes
    ----------
    inputs : tuple of Input
    ahead : mapping
        Command of every input on a straight course.
    turned : tuple of str
        Inputs that take the helm angle itself: rudders, or azimuths where there is no rudder.
    paired : mapping of str to float
        Share by which a thruster's command changes per unit of helm over hard over, where thrusters steer.
    sign : float
        Sign of the helm that turns to starboard.
    """

    inputs: tuple[Input, ...]
    ahead: Mapping[str, float]
    turned: tuple[str, ...]
    paired: Mapping[str, float]
    sign: float = 1.0

    @property
    def steers(self) -> bool:
        """Whether anything answers to the helm."""
        return bool(self.turned or self.paired)

    def commands(self, helm: FloatArray, throttle: FloatArray) -> dict[str, FloatArray]:
        """Commands (n,) of every input for helm (n,), rad, positive to starboard, and throttle (n,), 1 ahead."""
        out = {}
        for item in self.inputs:
            base = self.ahead[item.name] * throttle
            if item.name in self.turned:
                out[item.name] = self.ahead[item.name] + self.sign * helm
            else:
                share = self.paired.get(item.name, 0.0)
                out[item.name] = base * (1.0 + share * self.sign * helm / HARD_OVER)
        return out


def helm_for(inputs: tuple[Input, ...], ahead: Mapping[str, float]) -> Helm:
    """Choose what steers: rudders, else azimuths, else the difference of thrusters on both sides."""
    rudders = tuple(i.name for i in inputs if i.kind == "rudder")
    azimuths = tuple(i.name for i in inputs if i.kind == "azimuth")
    turned = rudders or azimuths
    paired = {} if turned else _pairs(inputs)
    return Helm(inputs, ahead, turned, paired)


def _pairs(inputs: tuple[Input, ...]) -> dict[str, float]:
    """More thrust on the port side turns to starboard."""
    sides = {i.name: i.position[1] for i in inputs if i.kind in ("propeller", "thruster")}
    both = any(y > 0 for y in sides.values()) and any(y < 0 for y in sides.values())
    return {n: -float(np.sign(y)) for n, y in sides.items() if y} if both else {}


def shape_of(inputs: tuple[Input, ...], typical: Mapping[str, float]) -> dict[str, float]:
    """Commands on a straight course, up to a common factor: typical values, or all drives alike."""
    screws = [i.name for i in inputs if i.kind in ("propeller", "thruster")]
    known = np.array([typical.get(n, 0.0) for n in screws])
    level = float(np.mean(known)) if len(known) and np.mean(known) > 0 else 1.0
    return {i.name: level if i.name in screws else 0.0 for i in inputs}


def require_steering(helm: Helm, kind: str) -> None:
    """Complain where a manoeuvre needs a helm and there is none.

    Raises
    ------
    UsageError
    """
    if not helm.steers:
        raise UsageError(
            f"{kind}: none of the inputs ({', '.join(i.name for i in helm.inputs) or 'none'}) steers this vessel: "
            "a rudder, an azimuth, or thrusters with positions on both sides would."
        )


def driven(inputs: tuple[Input, ...]) -> bool:
    """Whether anything gives thrust ahead."""
    return any(i.kind in ("propeller", "thruster") for i in inputs) or bool(azimuth_of(inputs))
