"""How much slower than a small boat a vessel answers."""

from __future__ import annotations

import math

#: Up to this length, m, all are as quick; and no ship is so many times slower.
QUICK, SLOWEST = 5.0, 5.0


def slower(length: float) -> float:
    """How many times slower a vessel of this length, m, is than one of five: times grow with its root (Froude)."""
    return max(1.0, min(math.sqrt(length / QUICK), SLOWEST))
