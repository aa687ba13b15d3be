"""The motion behind what the sensors show, and its accelerations, for all values that are looked at of an effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from identify.drive import Drive
from identify.regression import Motionwise, answers, motionwise
from identify.slopes import accelerations, averaged
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


class Designs(NamedTuple):
    """Regressors (m, terms) as slopes over ``FINE`` steps, and over ``SLOPE``, see them."""

    fine: FloatArray
    slow: FloatArray


@dataclass(frozen=True)
class Motion:
    """The motion behind what the sensors show, its rates and what it makes of the terms.

    Made once for all values that follow each other with the same of it.
    """

    structure: Structure
    stretches: Sequence[Stretch]
    known: dict[bytes, Seen] = field(default_factory=dict)
    last: dict[bytes, list[tuple[Motionwise, Designs]]] = field(default_factory=dict)

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

    def designs(self, driven: Sequence[Drive]) -> Designs:
        """Regressors of all stretches with the inputs, the sensors, the air and the water as they are in ``driven``."""
        which, parts = [k for k, _ in self.structure.table.answering], []
        for d, (moving, still) in zip(driven, self._alike(driven), strict=True):
            one = Designs(*(x.copy() for x in still))
            if which:
                answering = self._averaged(answers(self.structure, moving, d.channels))
                for column, here in zip(answering, one, strict=True):
                    here[:, which] = column
            parts.append([x * d.factor for x in one])
        return Designs(*(np.vstack(x) for x in zip(*parts, strict=True)))

    def _alike(self, driven: Sequence[Drive]) -> list[tuple[Motionwise, Designs]]:
        """Per stretch what the motion makes of the terms, and their regressors where no input answers."""
        key = b"".join(x.tobytes() for d in driven for x in (d.sensor, d.current, d.wind[:1], np.array(d.u0)))
        if key not in self.last:
            moving = [
                motionwise(self.structure, d, x) for d, x in zip(driven, self.by(driven).states, strict=True)
            ]
            self.last.clear()
            self.last[key] = [(m, self._averaged(m.products)) for m in moving]
        return self.last[key]

    def _averaged(self, columns: FloatArray) -> Designs:
        """Columns (n, k) of a stretch, as both kinds of slopes see them, where they are looked at."""
        return Designs(*(averaged(columns, m, self.every) for m in (FINE, self.slope)))
