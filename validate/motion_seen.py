"""The motion behind what the sensors show, and its accelerations, for all values that are looked at of an effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from identify.drive import Drive
from identify.regression import accelerations, averaged, predicted
from identify.stretch import Stretch
from identify.structure import Structure
from identify.true_motion import true_states

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
#: What the accelerations gain by an effect, and the parameters (np,) that they want.
Wanted = tuple[float, FloatArray]

#: Accelerations are slopes over so many steps either way where the coefficients are found, and where a misfit is
#: measured over this time, s.
FINE, SLOPE = 5, 1.0
#: ... at every second step, or third, or so, that leaves so many of all logs together: smooth motion says the same in
#: those between them.
ROWS = 2000


@dataclass(frozen=True)
class Seen:
    """What the sensors show with some values of their parameters and of the current.

    Per stretch the states (n + 1, 6) over ground; of all the rates (m, 3) through the water over ``FINE`` steps and
    over ``SLOPE``, and the variance (3,) of the latter over ground, against which any current is weighed alike.
    """

    states: list[FloatArray]
    fine: FloatArray
    slow: FloatArray
    size: FloatArray


@dataclass(frozen=True)
class Motion:
    """The motion behind what the sensors show, and its rates, made once for all values with the same of both."""

    structure: Structure
    stretches: Sequence[Stretch]
    known: dict[bytes, Seen] = field(default_factory=dict)

    @property
    def every(self) -> int:
        """Of so many rows one is looked at."""
        return max(1, sum(s.steps for s in self.stretches) // ROWS)

    @property
    def slope(self) -> int:
        """Steps either way over which a misfit is measured."""
        return max(1, round(SLOPE / self.stretches[0].h))

    def by(self, driven: Sequence[Drive]) -> Seen:
        """What is seen as the sensors and the water are in ``driven``."""
        key = b"".join(x.tobytes() for d in driven for x in (d.sensor, d.current))
        if key not in self.known:
            self.known[key] = self._made(driven)
        return self.known[key]

    def _made(self, driven: Sequence[Drive]) -> Seen:
        moving = [
            true_states(self.structure, d.sensor, s) for d, s in zip(driven, self.stretches, strict=True)
        ]
        currents = [d.current for d in driven]
        fine, slow = (self._rates(moving, currents, m) for m in (FINE, self.slope))
        ground = self._rates(moving, [np.zeros(2)] * len(moving), self.slope)
        return Seen(moving, fine, slow, np.var(ground, axis=0) + 1e-12)

    def _rates(self, moving: Sequence[FloatArray], currents: Sequence[FloatArray], m: int) -> FloatArray:
        runs = zip(self.stretches, moving, currents, strict=True)
        return self.thinned([accelerations(s, m, x, c) for s, x, c in runs])

    def thinned(self, rates: Sequence[FloatArray]) -> FloatArray:
        """Rows of all stretches that are looked at."""
        return np.vstack([x[:: self.every] for x in rates])

    def predicted(self, p: FloatArray, rates: Sequence[FloatArray]) -> FloatArray:
        """Accelerations (m, 3) by regressors (n, terms), as slopes over ``slope`` steps see them."""
        every = (predicted(self.structure, p, x) for x in rates)
        return self.thinned([averaged(x, self.slope) for x in every])
