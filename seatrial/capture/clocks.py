"""The host's clocks: a continuous one that the record goes by, and the wall clock beside it."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import NamedTuple

#: A wall clock that moves by more than this against the continuous one was set, not slewed, ns.
STEP_NS = 50_000_000


class Stamp(NamedTuple):
    """When something arrived.

    Attributes
    ----------
    log_ns : int
        UTC when the clock began + monotonic time since: never steps.
    wall_ns : int
        UTC as the host believed it to be at that instant.
    """

    log_ns: int
    wall_ns: int


@dataclass
class HostClock:
    """Stamps on a clock that is UTC when it begins, and monotonic from then on.

    Attributes
    ----------
    utc_ns, monotonic_ns : int
        Both clocks when it began.
    """

    utc_ns: int = field(default_factory=time.time_ns)
    monotonic_ns: int = field(default_factory=time.monotonic_ns)
    _shift_ns: int = 0

    def stamp(self) -> Stamp:
        """Both clocks, now."""
        return Stamp(self.utc_ns + time.monotonic_ns() - self.monotonic_ns, time.time_ns())

    def stepped(self) -> int:
        """Nanoseconds by which the wall clock was set since the last call; 0 where it was not."""
        now = self.stamp()
        step = now.wall_ns - now.log_ns - self._shift_ns
        if abs(step) < STEP_NS:
            return 0
        self._shift_ns += step
        return step
