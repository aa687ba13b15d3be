"""Places in the vector of parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from identify.effect import Parameter
from identify.term import Term

#: Ending of the names of what is not known of a stream's stamps.
CLOCK = "_clock"
#: Name of the speed that terms in Δu are about, and how well it is known before the fit, as a share of the guess.
U0, U0_KNOWN = "u0", 0.3


@dataclass(frozen=True)
class Slot:
    """One place in the vector of parameters.

    ``coefficient`` is the index of the coefficient that it is (a linear parameter), or -1; ``effect`` the index of
    the active effect that it belongs to, or -1 for the model itself; ``prior`` (mean, standard deviation), where
    something is known beforehand.
    """

    name: str
    effect: int
    parameter: Parameter
    coefficient: int = -1
    term: Term | None = None
    prior: tuple[float, float] | None = None

    @property
    def nuisance(self) -> bool:
        """Whether it says when something was logged, and nothing of the vessel."""
        return self.effect < 0 and (self.name == "input_lead" or self.name.endswith(CLOCK))


def clocks(unsure: Mapping[str, float]) -> list[Slot]:
    """One for each stream whose stamps are known to within a standard deviation ``unsure``, s."""
    return [
        Slot(name, -1, Parameter(name, "s", sd, (-2.2 * sd, 2.2 * sd)), prior=(0.0, sd))
        for name, sd in ((f"{stream}{CLOCK}", sd) for stream, sd in unsure.items())
    ]


def reference_speed(guess: float) -> Slot:
    """The speed that terms in Δu are about, near a first ``guess``, m/s: with it, the model's own speed is found."""
    sd = U0_KNOWN * guess
    return Slot(
        U0, -1, Parameter(U0, "m/s", 0.1 * guess, (0.5 * guess, 2.0 * guess), guess), prior=(guess, sd)
    )
