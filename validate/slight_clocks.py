"""Stamps that are off by no more than those of any logger: known to be so in the fit, and no effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from identify.fitted import Fitted
from identify.structure import Structure
from validate.look_alikes import refitted_as


def slight_clocks(fitted: Fitted) -> tuple[int, ...]:
    """Which effects of a fit say no more than that one stream's stamps are off by as little as any are."""
    structure = fitted.solution.structure
    clocks = [k for k, active in enumerate(structure.actives) if active.effect.place == "clock"]
    return tuple(k for k in clocks if _is_slight(structure, structure.values(fitted.solution.p, k), k))


def _is_slight(structure: Structure, values: Mapping[str, float], index: int) -> bool:
    """Whether none of an effect's parameters is off its null by more than it is in any log."""
    parameters = structure.actives[index].effect.parameters
    return all(abs(values[p.name] - p.null) <= p.slight for p in parameters)


def with_slight_clocks_known(fitted: Fitted) -> Fitted:
    """The fit with such effects as what is known beforehand: each sensor's stamps to within so much of the position's.

    What else the fit has is not told wrongly for it. The same fit where there are none.
    """
    structure, slight = fitted.solution.structure, slight_clocks(fitted)
    if not slight:
        return fitted
    size = max(p.slight for k in slight for p in structure.actives[k].effect.parameters)
    actives = tuple(a for k, a in enumerate(structure.actives) if k not in slight)
    sensors: dict[str, float] = {s: size for s in ("heading", "yaw_rate") if s in structure.setting.streams}
    unsure = sensors | {s: max(sd, sensors.get(s, 0.0)) for s, sd in structure.unsure.items()}
    return refitted_as(fitted, replace(structure, actives=actives, unsure=unsure))
