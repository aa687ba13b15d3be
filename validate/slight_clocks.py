"""Stamps that are off by no more than those of any logger: known to be so in the fit, and no effect."""

from __future__ import annotations

from dataclasses import replace

from identify.fitted import Fitted
from validate.look_alikes import refitted_as

#: Stamps are off by so much, s, in any logger: some hundred bytes take as long through a serial line, a message as long
#: in a queue, and a receiver as long over its solution.
SLIGHT = 0.02


def slight_clocks(fitted: Fitted) -> tuple[int, ...]:
    """Which effects of a fit say no more than that one stream's stamps are off by as little as any are."""
    structure, p = fitted.solution.structure, fitted.solution.p
    return tuple(
        k
        for k, active in enumerate(structure.actives)
        if active.effect.name == "clock_offset" and abs(structure.values(p, k)["offset"]) <= SLIGHT
    )


def with_slight_clocks_known(fitted: Fitted) -> Fitted:
    """The fit with such effects as what is known beforehand: each sensor's stamps to within so much of the position's.

    What else the fit has is not told wrongly for it. The same fit where there are none.
    """
    structure, slight = fitted.solution.structure, slight_clocks(fitted)
    if not slight:
        return fitted
    actives = tuple(a for k, a in enumerate(structure.actives) if k not in slight)
    sensors: dict[str, float] = {s: SLIGHT for s in ("heading", "yaw_rate") if s in structure.setting.streams}
    unsure = sensors | {s: max(sd, sensors.get(s, 0.0)) for s, sd in structure.unsure.items()}
    return refitted_as(fitted, replace(structure, actives=actives, unsure=unsure))
