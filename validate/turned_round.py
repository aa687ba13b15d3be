"""An azimuth that stands half a turn from where its log has it, and a propeller that runs the wrong way: one cause."""

from __future__ import annotations

import math

import numpy as np

from identify.effects.actuators import ACTUATOR_OFFSET
from identify.structure import Structure
from validate.candidates import wirings

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: No azimuth is so far from half a turn by its trim alone, rad.
NEARLY = 0.1


def same_wiring(structure: Structure, p: FloatArray, index: int) -> str | None:
    """The wiring (its label) that is the same as an effect of a fit: what turns thrust round either way; else None."""
    active = structure.actives[index]
    turned = next((i for i in structure.inputs if i.name == active.variant.input), None)
    if active.effect is not ACTUATOR_OFFSET or turned is None or turned.kind != "azimuth":
        return None
    offset = structure.values(p, index)["offset"]
    if abs(abs(math.remainder(offset, 2.0 * math.pi)) - math.pi) > NEARLY:
        return None
    reversed_ = ((w, w.variant.options.get("reversed")) for w in wirings(structure))
    return next((w.label for w, names in reversed_ if names == (turned.drives,)), None)
