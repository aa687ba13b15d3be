"""What the on-line identification has to say, while it goes on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

#: Topics of readings.
PARAMETERS, ERRORS, MONITOR, MOTION = "parameters", "errors", "monitor", "motion"


@dataclass(frozen=True)
class Reading:
    """Named values at one time.

    Attributes
    ----------
    topic : str
        ``parameters``, ``errors``, ``monitor`` or ``motion``.
    t : float
        s since the first record.
    values, units : mapping
    """

    topic: str
    t: float
    values: Mapping[str, float]
    units: Mapping[str, str]


@dataclass(frozen=True)
class Note:
    """A line for the person; ``warning`` where something is wrong with the vessel or the model."""

    t: float
    text: str
    warning: bool = False


Update = Reading | Note
