"""From helm and throttle to the vessel's inputs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from identify.forces import THRUSTING, azimuth_of
from ingest.errors import UsageError
from preprocess.vessel import Input

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Helm at which differential thrust stops the inner thruster.
HARD_OVER = math.radians(35.0)
#: What is more than so many times the largest of the logs is beyond them: feedback is never quite the order.
BEYOND = 1.05
#: Commands up to this are shares of the largest, a little over.
SHARE = 1.5


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
    limits : mapping of str to float
        Greatest command of every input, without sign; inf where nothing says it.
    """

    inputs: tuple[Input, ...]
    ahead: Mapping[str, float]
    turned: tuple[str, ...]
    paired: Mapping[str, float]
    sign: float = 1.0
    limits: Mapping[str, float] = field(default_factory=dict)

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
                share, most = self.paired.get(item.name, 0.0), self.limits.get(item.name, math.inf)
                out[item.name] = np.clip(base * (1.0 + share * self.sign * helm / HARD_OVER), -most, most)
        return out

    def beyond(self, helm: float, throttle: float, largest: Mapping[str, float]) -> list[str]:
        """What is said of a helm (rad, to either side) or of a throttle beyond the ``largest`` commands of the logs."""
        asked = self.commands(np.array([helm, -helm, 0.0]), np.array([1.0, 1.0, throttle]))
        far = {n: float(np.abs(v).max()) for n, v in asked.items()} | dict.fromkeys(self.turned, helm)
        return [
            _extrapolated(n, far[n], largest[n], n in self.turned)
            for n in far
            if n in largest and far[n] > BEYOND * largest[n]
        ]

    def words(self, helm: float) -> list[str]:
        """How a helm (rad) to starboard is applied where thrusters steer; nothing where a rudder or an azimuth does."""
        if not self.paired:
            return []
        ahead, turning = (
            ", ".join(f"{n} {v:.3g}" for n, (v,) in values.items() if n in self.paired)
            for values in (self.commands(np.array([angle]), np.ones(1)) for angle in (0.0, helm))
        )
        limits = sorted({f"{self.limits[n]:.3g}" for n in self.paired if math.isfinite(self.limits[n])})
        within = f", which goes no further than {' or '.join(limits)}" if limits else ""
        return [
            f"A helm of {math.degrees(helm):.3g}° to starboard is {turning} (ahead: {ahead}; 35° stops the inner "
            f"one and doubles the outer one{within})."
        ]


def _extrapolated(name: str, asked: float, known: float, turned: bool) -> str:
    if turned:
        asked, known = math.degrees(asked), math.degrees(known)
        return (
            f"A helm of {asked:.3g}° is an extrapolation: in the logs {name} never goes beyond ±{known:.3g}°."
        )
    return (
        f"A command of {name} {asked:.3g} is an extrapolation: in the logs it never goes beyond {known:.3g}."
    )


def greatest(item: Input, logged: float = 0.0) -> float:
    """The greatest command of an input: by its calibration, or 1 of what is a share; no less than what was logged."""
    known = max(map(abs, item.value), default=1.0 if _is_share(item, logged) else math.inf)
    return max(known, logged)


def _is_share(item: Input, logged: float) -> bool:
    """Whether the commands of an input are shares of the largest: in percent, or of a thruster without a unit."""
    if item.unit is None:
        return item.kind in ("thruster", "tunnel") and logged <= SHARE
    return item.unit == "percent" and item.kind in THRUSTING


def helm_for(
    inputs: tuple[Input, ...], ahead: Mapping[str, float], largest: Mapping[str, float] | None = None
) -> Helm:
    """Choose what steers: rudders, else azimuths, else the difference of thrusters on both sides.

    ``largest`` are the commands that the logs had, without sign.
    """
    rudders = tuple(i.name for i in inputs if i.kind == "rudder")
    azimuths = tuple(i.name for i in inputs if i.kind == "azimuth")
    turned = rudders or azimuths
    paired = {} if turned else _pairs(inputs)
    limits = {i.name: greatest(i, (largest or {}).get(i.name, 0.0)) for i in inputs}
    return Helm(inputs, ahead, turned, paired, limits=limits)


def _pairs(inputs: tuple[Input, ...]) -> dict[str, float]:
    """More thrust on the port side turns to starboard."""
    sides = {i.name: i.position[1] for i in inputs if i.kind in ("propeller", "thruster")}
    both = any(y > 0 for y in sides.values()) and any(y < 0 for y in sides.values())
    return {n: -float(np.sign(y)) for n, y in sides.items() if y} if both else {}


def shape_of(inputs: tuple[Input, ...], typical: Mapping[str, float]) -> dict[str, float]:
    """Commands on a straight course, up to a common factor: typical values, or all drives alike."""
    screws = [i.name for i in inputs if i.kind in ("propeller", "thruster")]
    level = _typical_ahead(screws, typical) or 1.0
    return {i.name: level if i.name in screws else 0.0 for i in inputs}


def assumed(inputs: tuple[Input, ...], typical: Mapping[str, float]) -> list[str]:
    """What is said where the drives go ahead at a command that is not that of the logs."""
    screws = [i.name for i in inputs if i.kind in ("propeller", "thruster")]
    if not screws or _typical_ahead(screws, typical):
        return []
    return ["No thrust ahead is typical of the logs: the approach is at a command of 1."]


def _typical_ahead(screws: Sequence[str], typical: Mapping[str, float]) -> float | None:
    """Mean of the typical commands of the drives; None where that is not ahead."""
    mean = sum(typical.get(n, 0.0) for n in screws) / max(len(screws), 1)
    return mean if mean > 0.0 else None


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
