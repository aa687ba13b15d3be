"""What the campaign declares about the vessel, its inputs and its sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

#: The kinds of input that a campaign may declare.
KINDS = ("rudder", "propeller", "thruster", "azimuth", "tunnel")
#: The smoothers that a campaign may choose.
SMOOTHERS = ("rts", "eso", "ekf", "nomoto_eso")


@dataclass(frozen=True)
class Vessel:
    """Particulars in SI units; positions are (forward, starboard) of the campaign's origin point.

    ``added_mass`` is that of surge and sway, kg, and of yaw, kg m². ``reference_speed`` is that of a model's terms in
    Δu, m/s, where it is known.
    """

    name: str
    length: float
    beam: float
    draught: float | None = None
    mass: float | None = None
    yaw_inertia: float | None = None
    centre_of_gravity: tuple[float, float] | None = None
    origin: str = "origin"
    antenna: tuple[float, float] = (0.0, 0.0)
    imu: tuple[float, float] = (0.0, 0.0)
    depth: float | None = None
    magnetic_variation: float = 0.0
    propeller: Mapping[str, float] = field(default_factory=dict)
    rudder: Mapping[str, float] = field(default_factory=dict)
    added_mass: tuple[float, float, float] | None = None
    reference_speed: float | None = None


@dataclass(frozen=True)
class Input:
    """One actuator: how its column is found in the log and what it does.

    ``unit`` is that of the values in the log, where no calibration (``pwm`` to ``value``) is given. After
    preprocessing the values are rad (rudder, azimuth), rev/s (propeller), -1…1 or N (thruster, tunnel).
    """

    name: str
    kind: str
    signal: str | None = None
    pwm: tuple[float, ...] = ()
    value: tuple[float, ...] = ()
    unit: str | None = None
    law: str = "quadratic"
    position: tuple[float, float] = (0.0, 0.0)
    drives: str | None = None
    source: int | None = None


@dataclass(frozen=True)
class Sensor:
    """Where a quantity is taken from, where detection is not enough; ``signals`` maps component to TOPIC.FIELD.

    ``latency`` is by how much its stamps are late, s; None where nothing is said: then a velocity from the receiver of
    the position has that of the position.
    """

    quantity: str
    signals: Mapping[str, str] = field(default_factory=dict)
    unit: str | None = None
    source: int | None = None
    offset: float = 0.0
    latency: float | None = None
    reference: str | None = None


@dataclass(frozen=True)
class Smoothing:
    """What a campaign says of the smoother.

    Attributes
    ----------
    smoother : str
        ``rts``: the fixed-interval smoother; ``eso``: the third-order linear extended state observer of Xie et al.
        (2020) per channel; ``nomoto_eso``: the turning by the five-state ESO of Zhu et al. (2022), for models of yaw
        alone; ``ekf``: an extended Kalman filter. Observers know only what came before.
    bandwidth : float, optional
        Of either ESO, rad/s; None: for each channel that of the least expected error of the velocity.
    """

    smoother: str = "rts"
    bandwidth: float | None = None
