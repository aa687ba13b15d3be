"""Offset of a stream's stamps: what is found, and the search for the least of a function of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from preprocess.trial import FloatArray

#: Offsets are searched for up to this, s.
LONGEST = 1.5
#: Reported beyond this many standard errors, and this many seconds.
STANDARD_ERRORS = 4.0
LEAST = 0.03
#: One that is less sure than this is not given, s.
WORST = 0.4
#: An offset that rests on a model must explain this much: else it may make up for what the model lacks.
LEAST_GAIN = 1.5
#: … that of a position, which a poor model of the sway makes up for more easily.
LEAST_GAIN_POSITION = 2.5


@dataclass(frozen=True)
class ClockOffset:
    """Offset of a stream's stamps.

    Attributes
    ----------
    stream, against : str
    offset, stderr : float
        Stamp less true time, s, taking the stamps of ``against`` for true.
    gain : float
        How many times less is left unexplained with the offset than without, where it rests on a model of the
        response; infinite where it rests on kinematics alone, or on a hull that leaves nothing but noise.
    """

    stream: str
    against: str
    offset: float
    stderr: float
    gain: float = float("inf")

    @property
    def seen(self) -> bool:
        """Whether it differs from zero by more than chance."""
        least = LEAST_GAIN_POSITION if self.stream == "position" else LEAST_GAIN
        return abs(self.offset) > max(STANDARD_ERRORS * self.stderr, LEAST) and self.gain > least

    def __str__(self) -> str:
        amount = f"{abs(self.offset):.3f} ± {self.stderr:.3f}"
        late = "later" if self.offset > 0 else "earlier"
        said = f"The stamps of {self.stream} are {amount} s {late} than those of {self.against} say."
        if self.stream != "the inputs" or self.offset > 0.0:
            return said
        return f"{said} A delay or a lag of the actuators would look the same."


def parabola_minimum(tau: FloatArray, value: FloatArray) -> tuple[float, float]:
    """Place of the minimum and second derivative there, from a parabola through the lowest five points."""
    k = int(np.clip(np.argmin(value), 2, len(tau) - 3))
    near = slice(k - 2, k + 3)
    c = np.polyfit(tau[near] - tau[k], value[near] - value[k], 2)
    if c[0] <= 0.0:
        return float(tau[k]), 0.0
    return float(tau[k] + np.clip(-c[1] / (2.0 * c[0]), tau[k - 2] - tau[k], tau[k + 2] - tau[k])), float(
        2.0 * c[0]
    )


def search(
    objective: Callable[[float], float], longest: float = LONGEST, start: float = 0.0
) -> tuple[float, float]:
    """Minimum of a function of an offset, on finer and finer grids; (place, curvature)."""
    centre, width, curvature = start, longest, 0.0
    for _ in range(3):
        tau = np.linspace(centre - width, centre + width, 13)
        centre, curvature = parabola_minimum(tau, np.array([objective(float(x)) for x in tau]))
        width /= 4.0
    return centre, curvature
