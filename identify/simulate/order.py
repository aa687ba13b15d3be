"""What is to be done: which manoeuvre, with which angles, at which speed."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ingest.errors import UsageError, nearest

#: Manoeuvres with their usual helm angle, degrees.
KINDS = {"zigzag": 20.0, "circle": 35.0, "spiral": 25.0, "stopping": 0.0}
_ALIASES = {"turning": "circle", "turning_circle": "circle", "turn": "circle", "stop": "stopping"}
_TEXT = re.compile(
    r"\s*(?P<kind>[a-z_]+?)[\s_]*(?P<helm>\d+(?:\.\d+)?)?(?:\s*/\s*(?P<heading>\d+(?:\.\d+)?))?"
    r"(?:\s+(?P<side>port|starboard))?\s*"
)


@dataclass(frozen=True)
class Order:
    """A manoeuvre that is asked for.

    Attributes
    ----------
    kind : str
        ``zigzag``, ``circle``, ``spiral`` or ``stopping``.
    helm : float
        Rudder (or azimuth) angle, rad; where thrusters steer by their difference, 35 degrees stop the inner one and
        double the outer one, which goes no further than its range does.
    heading : float
        Change of heading at which a zigzag's helm is reversed, rad.
    side : int
        1: first to starboard; -1: to port.
    speed : float, optional
        Approach speed, m/s; by default that which the typical inputs give.
    helm_rate : float, optional
        How fast the helm moves, rad/s; by default at once (as far as the identified actuator can).
    helm_delay : float
        How long after a zigzag's heading is reached the helm begins to move, s.
    reverse : float
        Thrust command astern over that ahead, for ``stopping``.
    samples : int
        Draws from the parameters' covariance for the uncertainty; 0 for none.
    log : str, optional
        The log whose loading and depth are simulated, of those that an effect names; by default those of all others.
    conditions : bool
        Keep current and wind as they were identified; by default the sea is calm.
    """

    kind: str = "zigzag"
    helm: float = math.radians(20.0)
    heading: float = math.radians(20.0)
    side: int = 1
    speed: float | None = None
    helm_rate: float | None = None
    helm_delay: float = 0.0
    reverse: float = 1.0
    samples: int = 100
    log: str | None = None
    conditions: bool = False

    @property
    def title(self) -> str:
        """``zigzag 20/20, starboard first``."""
        helm, heading = (f"{math.degrees(a):g}" for a in (self.helm, self.heading))
        side = "starboard" if self.side > 0 else "port"
        return {
            "zigzag": f"zigzag {helm}/{heading}, {side} first",
            "circle": f"turning circle {helm}° to {side}",
            "spiral": f"spiral {helm}°",
        }.get(self.kind, self.kind)


def parse_order(text: str) -> Order:
    """Read ``zigzag 20/20``, ``zigzag10/10 port``, ``circle 35``, ``spiral``, ``stopping``; degrees.

    Raises
    ------
    UsageError
        Where it is none of these.
    """
    match = _TEXT.fullmatch(text.lower().replace("turning circle", "circle"))
    kind = _ALIASES.get(match["kind"], match["kind"]) if match else ""
    if match is None or kind not in KINDS:
        near = nearest(kind or text, list(KINDS))
        hint = f" Did you mean '{near[0]}'?" if near else ""
        raise UsageError(
            f"manoeuvre: expected zigzag 20/20, circle 35, spiral or stopping, found '{text}'.{hint}"
        )
    helm = float(match["helm"] or KINDS[kind])
    heading = float(match["heading"] or helm)
    return Order(kind, math.radians(helm), math.radians(heading), -1 if match["side"] == "port" else 1)


def ordered(manoeuvre: object) -> Order:
    """The order that is meant, by its words or as it is.

    Raises
    ------
    UsageError
        Where it is none.
    """
    if isinstance(manoeuvre, str):
        return checked(parse_order(manoeuvre))
    if isinstance(manoeuvre, Order):
        return checked(manoeuvre)
    raise UsageError(f"manoeuvre: expected words such as 'zigzag 20/20', or an Order, found {manoeuvre!r}.")


def checked(order: Order) -> Order:
    """The order itself.

    Raises
    ------
    UsageError
        A value that cannot be simulated.
    """
    if order.kind not in KINDS:
        raise UsageError(f"manoeuvre: expected one of {', '.join(KINDS)}, found '{order.kind}'.")
    if order.kind != "stopping" and not 0.0 < order.helm <= math.pi / 2:
        found = f"{math.degrees(order.helm):g}°"
        raise UsageError(
            f"manoeuvre: a helm of {found} cannot be given: expected more than 0°, and at most 90°."
        )
    if order.kind == "zigzag" and not 0.0 < order.heading <= math.pi:
        raise UsageError(
            f"manoeuvre: a zigzag needs a heading angle, found {math.degrees(order.heading):g}°."
        )
    if not order.helm_delay >= 0.0:
        raise UsageError(f"manoeuvre: the helm cannot move {-order.helm_delay:g} s before it is asked to.")
    if order.helm_rate is not None and not order.helm_rate > 0.0:
        found = f"{math.degrees(order.helm_rate):g}°/s"
        raise UsageError(f"manoeuvre: the rate of the helm must be positive, found {found}.")
    if order.speed is not None and not order.speed > 0.0:
        raise UsageError(f"manoeuvre: the approach speed must be positive, found {order.speed:g} m/s.")
    return order
