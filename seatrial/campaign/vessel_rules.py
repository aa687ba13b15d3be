"""What the geometry of a vessel must be beyond the types of its keys: what no vessel has is a slip of the pen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from seatrial.campaign.faults import Fault, found
from seatrial.campaign.tables import CampaignTable

#: Where something is on board, [m forward, m starboard] of the origin.
PLACES = ("antenna", "imu", "centre_of_gravity")


def geometry_faults(table: CampaignTable) -> Iterator[Fault]:
    """A hull wider than long, what is off the vessel, a variation that is more than half a turn."""
    vessel = table.vessel
    if vessel.beam > vessel.length:
        yield Fault(("vessel", "beam"), f"at most the length, {vessel.length:g} m", found(vessel.beam))
    if abs(vessel.magnetic_variation_deg) > 180.0:
        yield Fault(
            ("vessel", "magnetic_variation_deg"),
            "an angle between -180 and 180 degrees",
            found(vessel.magnetic_variation_deg),
        )
    for place in PLACES:
        yield from place_faults(("vessel", place), getattr(vessel, place), vessel.length)
    for name, declared in table.inputs.items():
        yield from place_faults(("inputs", name, "position"), declared.position, vessel.length)


def place_faults(key: tuple[str, ...], place: Sequence[float] | None, length: float) -> Iterator[Fault]:
    """What is farther from the origin than the vessel is long is not on board."""
    if place is not None and max(map(abs, place)) > length:
        yield Fault(
            key, f"a place on board, no farther from the origin than the length, {length:g} m", found(place)
        )
