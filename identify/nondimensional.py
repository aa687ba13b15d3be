"""The prime system: coefficients without dimension, and back (SNAME 1950).

Lengths are measured in ship lengths L, speeds in the reference speed U, times in L/U. A coefficient per unit inertia
multiplies a regressor; its prime value is what it is when all of these are 1: revolutions are measured in U/L,
angles are numbers.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.fit import Estimated

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

_POWERS = {"": 1, "²": 2, "³": 3, "⁴": 4}
_PART = re.compile(r"(?P<name>m|s)(?P<power>[²³⁴]|\^\d+)?")


def dimensions(unit: str) -> tuple[int, int]:
    """Powers of metre and second in a unit: ``"1/(m·s²)"`` gives ``(-1, -2)``.

    Raises
    ------
    ValueError
        Where the unit is made of anything else.
    """
    metres = seconds = 0
    for k, group in enumerate(unit.replace("(", "").replace(")", "").split("/")):
        for part in group.split("·"):
            if part in ("1", "rad"):
                continue
            match = _PART.fullmatch(part)
            if match is None:
                raise ValueError(f"unit '{unit}': expected metres and seconds, found '{part}'")
            power = (1 if k == 0 else -1) * _power(match["power"] or "")
            metres += power if match["name"] == "m" else 0
            seconds += power if match["name"] == "s" else 0
    return metres, seconds


def _power(text: str) -> int:
    return int(text[1:]) if text.startswith("^") else _POWERS[text]


def unit_size(unit: str, length: float, speed: float) -> float:
    """Size in SI of the prime system's unit of this dimension.

    Parameters
    ----------
    unit : str
        ``"1/m"``, ``"m/s²"``, …
    length, speed : float
        Reference length, m, and speed, m/s.
    """
    metres, seconds = dimensions(unit)
    return float(length**metres * (length / speed) ** seconds)


def to_prime(coefficients: Sequence[Estimated], length: float, speed: float) -> tuple[Estimated, ...]:
    """Coefficients with their standard errors in the prime system; their unit becomes ``"1"``."""
    sizes = [unit_size(c.unit, length, speed) for c in coefficients]
    return tuple(
        replace(c, value=c.value / s, stderr=c.stderr / s, unit="1")
        for c, s in zip(coefficients, sizes, strict=True)
    )


def from_prime(
    coefficients: Sequence[Estimated], units: Sequence[str], length: float, speed: float
) -> tuple[Estimated, ...]:
    """The same coefficients in SI units, at this length and speed: another ship of the same form, or the same."""
    sizes = [unit_size(u, length, speed) for u in units]
    return tuple(
        replace(c, value=c.value * s, stderr=c.stderr * s, unit=u)
        for c, s, u in zip(coefficients, sizes, units, strict=True)
    )


def scale_factors(units: Sequence[str], length: float, speed: float) -> FloatArray:
    """Factors (k,) that turn SI values into prime ones; a covariance takes their outer product."""
    return np.array([1.0 / unit_size(u, length, speed) for u in units])
