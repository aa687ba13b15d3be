"""Codes that loggers write where there is no value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: Round numbers, and the ends of whole numbers of 16 and 32 bits.
CODES = (
    -999.0,
    -9999.0,
    -99999.0,
    9999.0,
    99999.0,
    32767.0,
    -32768.0,
    65535.0,
    2.0**31 - 1,
    -(2.0**31),
    2.0**32 - 1,
)
#: Nothing that is measured is larger, in any unit: the largest number of 32 bits is written for none, too.
LARGEST = 1e30
#: They lie off the range of the rest by so many times its size.
CODE_OFF = 3.0
#: Numbers without which nothing is known of the rest.
FEWEST = 5


def codes(value: Floats) -> Bools:
    """Which numbers (n,) are such codes, far off all that is none."""
    code = np.isin(value, CODES)
    return code & off(value, value[~code], CODE_OFF)


def off(value: Floats, rest: Floats, times: float) -> Bools:
    """Which numbers (n,) lie off the range of the rest by so many times its size."""
    rest = rest[np.isfinite(rest)]
    if len(rest) < FEWEST:
        return np.zeros(len(value), dtype=bool)
    low, high = float(rest.min()), float(rest.max())
    size = max(high - low, abs(low), abs(high))
    return np.maximum(low - value, value - high) > times * size
