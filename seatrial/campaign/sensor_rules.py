"""What a sensor must be beyond the types of its keys."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from seatrial.campaign.faults import Fault, found, nearest_one
from seatrial.campaign.tables import SensorsTable, SensorTable

ANGLE = ("deg", "rad", "cdeg", "mrad")
LENGTH = ("m", "mm", "cm", "km", "ft", "nmi")
SPEED = ("m/s", "mm/s", "cm/s", "km/h", "kn", "ft/s")

#: The components that make each quantity, and the units that they may have.
COMPONENTS: Mapping[str, Mapping[tuple[str, ...], tuple[str, ...]]] = {
    "position": {("latitude", "longitude"): ("deg", "rad", "degE7", "degE5"), ("north", "east"): LENGTH},
    "heading": {("signal",): ANGLE},
    "yaw_rate": {("signal",): ("deg/s", "rad/s", "deg/min", "mrad/s", "cdeg/s")},
    "velocity": {("north", "east"): SPEED, ("forward", "starboard"): SPEED},
    "wind": {("speed", "direction"): ANGLE},
}


def sensor_faults(sensors: SensorsTable) -> Iterator[Fault]:
    """Faults of all sensors."""
    for quantity in COMPONENTS:
        sensor: SensorTable | None = getattr(sensors, quantity)
        if sensor is not None:
            yield from component_faults(quantity, signals_of(quantity, sensor))
            yield from unit_faults(quantity, sensor)
            yield from offset_faults(quantity, float(getattr(sensor, "offset", 0.0)))


def signals_of(quantity: str, sensor: SensorTable) -> dict[str, str]:
    """The signals that a sensor names, by component."""
    names = (name for pair in COMPONENTS[quantity] for name in pair)
    return {name: value for name in names if (value := getattr(sensor, name)) is not None}


def component_faults(quantity: str, signals: Mapping[str, str]) -> Iterator[Fault]:
    """A pair that is not whole, or two pairs at once."""
    pairs = list(COMPONENTS[quantity])
    if not signals or tuple(signals) in pairs:
        return
    expected = " or ".join(" and ".join(pair) for pair in pairs)
    yield Fault(("sensors", quantity), expected, " and ".join(signals))


def unit_faults(quantity: str, sensor: SensorTable) -> Iterator[Fault]:
    """A unit that the quantity cannot have."""
    if sensor.unit is None:
        return
    named = tuple(signals_of(quantity, sensor))
    by_pair = COMPONENTS[quantity]
    units = by_pair.get(named) or tuple(dict.fromkeys(u for us in by_pair.values() for u in us))
    if sensor.unit not in units:
        near = nearest_one(sensor.unit, units)
        yield Fault(
            ("sensors", quantity, "unit"),
            f"a unit of {' and '.join(named) or quantity} ({', '.join(units)})",
            found(sensor.unit),
            near,
        )


def offset_faults(quantity: str, offset: float) -> Iterator[Fault]:
    """An offset of more than a turn, which is one in degrees."""
    if abs(offset) > 2.0 * math.pi:
        unit = "rad/s" if quantity == "yaw_rate" else "rad"
        expected = f"the offset in {unit}, at most 2π ({offset:g}° are {math.radians(offset):.4g} rad)"
        yield Fault(("sensors", quantity, "offset"), expected, found(offset))
