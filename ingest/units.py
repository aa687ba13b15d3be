"""Units of measurement as logs write them, and their factors to SI.

A unit is a product of simple units: ``m/s``, ``m/s/s``, ``kg.m^2``, ``deg/s``; each may carry a decimal
prefix (``cdeg``, ``mm``, ``kN``) and an exponent. Angles become radians; revolutions stay revolutions
(``rpm`` becomes rev/s), as propellers are given in rev/s throughout; percent becomes a fraction.
"""

from __future__ import annotations

import functools
import math
import re

from ingest.errors import nearest

DEGREE = math.pi / 180.0

#: Simple units and whole names; these are looked up before prefixes are tried.
SIMPLE: dict[str, float] = {
    "": 1.0, "1": 1.0, "-": 1.0, "none": 1.0, "ratio": 1.0,
    "m": 1.0, "metre": 1.0, "metres": 1.0, "meter": 1.0, "meters": 1.0, "ft": 0.3048, "feet": 0.3048,
    "in": 0.0254, "yd": 0.9144, "fathom": 1.8288, "fm": 1.8288, "nmi": 1852.0, "NM": 1852.0, "nm": 1852.0,
    "mi": 1609.344,
    "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "min": 60.0, "minute": 60.0, "h": 3600.0,
    "hr": 3600.0, "hour": 3600.0,
    "rad": 1.0, "radian": 1.0, "radians": 1.0, "deg": DEGREE, "degree": DEGREE, "degrees": DEGREE,
    "°": DEGREE,
    "degE5": 1e-5 * DEGREE, "degE7": 1e-7 * DEGREE, "deg*1e7": 1e-7 * DEGREE, "deg*1e5": 1e-5 * DEGREE,
    "deglatitude": DEGREE, "deglongitude": DEGREE, "degheading": DEGREE,
    "rev": 1.0, "revs": 1.0, "rps": 1.0, "rpm": 1.0 / 60.0, "RPM": 1.0 / 60.0, "r/min": 1.0 / 60.0,
    "U/min": 1.0 / 60.0, "u/min": 1.0 / 60.0, "min-1": 1.0 / 60.0, "min^-1": 1.0 / 60.0,
    "kn": 1852.0 / 3600.0, "kt": 1852.0 / 3600.0, "kts": 1852.0 / 3600.0, "knot": 1852.0 / 3600.0,
    "knots": 1852.0 / 3600.0,
    "kph": 1.0 / 3.6, "kmh": 1.0 / 3.6, "mph": 1609.344 / 3600.0, "fps": 0.3048, "mps": 1.0, "dps": DEGREE,
    "percent": 0.01, "%": 0.01, "pct": 0.01,
    "g": 1e-3, "gram": 1e-3, "t": 1000.0, "lb": 0.45359237, "N": 1.0, "Nm": 1.0, "kgf": 9.80665,
    "lbf": 4.4482216152605,
    "G": 9.80665, "gn": 9.80665, "mG": 9.80665e-3,
    "Pa": 1.0, "bar": 1e5, "psi": 6894.757293168, "K": 1.0, "V": 1.0, "A": 1.0, "W": 1.0, "Wh": 3600.0,
    "J": 1.0,
    "Hz": 1.0, "Ah": 3600.0, "T": 1.0, "gauss": 1e-4, "Gauss": 1e-4, "mgauss": 1e-7, "Ohm": 1.0, "l": 1e-3,
    "L": 1e-3, "B": 1.0, "bytes": 1.0,
    "us_pwm": 1.0, "PWM": 1.0,
}  # fmt: skip
#: Units with a zero of their own: factor and offset.
SHIFTED: dict[str, tuple[float, float]] = {
    "degC": (1.0, 273.15), "°C": (1.0, 273.15), "C": (1.0, 273.15), "cdegC": (0.01, 273.15),
    "degF": (5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
}  # fmt: skip
PREFIXES: dict[str, float] = {
    "n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "da": 1e1, "h": 1e2,
    "k": 1e3, "M": 1e6,
}  # fmt: skip
#: Simple units that take a prefix.
PREFIXED = frozenset(
    [
        "m",
        "s",
        "rad",
        "deg",
        "g",
        "N",
        "Nm",
        "Pa",
        "bar",
        "V",
        "A",
        "W",
        "Wh",
        "J",
        "Hz",
        "Ah",
        "T",
        "gauss",
        "Ohm",
        "B",
        "l",
    ]
)
EXPONENTS = str.maketrans({"²": "2", "³": "3", "⁻": "-", "¹": "1"})
FACTOR = re.compile(r"(?P<name>.*?)(?:\^|\*\*)?(?P<power>-?[1-9])?$")


#: What the units of a quantity look like, whatever their size; of others any may be.
MEASURES: dict[str, re.Pattern[str]] = {
    "heading": re.compile(r".{0,2}(deg|rad|°|percent|%)[^/]*"),
    "yaw_rate": re.compile(r"(.{0,2}(deg|rad|rev|°).*|r|1)/.+|dps|degps|radps|rpm|RPM|rps"),
    "velocity": re.compile(r"(?!.*(deg|rad|rev|°)).+/.+|kn|kts?|knots?|mps|kph|kmh|mph|fps"),
}


def measures(quantity: str, unit: str) -> bool:
    """Whether a unit may be one of a quantity (``heading``, ``yaw_rate``, ``velocity``)."""
    return quantity not in MEASURES or MEASURES[quantity].fullmatch(unit.strip()) is not None


class UnknownUnit(ValueError):
    """A unit that is not in the table."""

    def __init__(self, unit: str) -> None:
        self.unit = unit
        near = nearest(unit, [*SIMPLE, *SHIFTED, "m/s", "deg/s", "rad/s", "km/h", "rev/s", "m/s/s"])
        hint = f"; nearest: {', '.join(n for n in near if n)}" if near else ""
        super().__init__(f"unknown unit '{unit}'{hint}")


@functools.lru_cache(maxsize=1024)
def factor_to_si(unit: str) -> tuple[float, float]:
    """Factor and offset from a unit to SI: ``si = scale * value + offset``.

    Parameters
    ----------
    unit : str
        As a log, a column name or a campaign writes it: ``deg``, ``cdeg``, ``degE7``, ``kn``, ``km/h``,
        ``m/s/s``.

    Returns
    -------
    scale, offset : float

    Raises
    ------
    UnknownUnit
        With the nearest known names.
    """
    name = unit.strip()
    if name in SHIFTED:
        return SHIFTED[name]
    if name in SIMPLE:
        return SIMPLE[name], 0.0
    scale = 1.0
    for i, part in enumerate(name.split("/")):
        product = math.prod(simple_factor(p, unit) for p in re.split(r"[.·* ]", part) if p)
        scale = scale * product if i == 0 else scale / product
    return scale, 0.0


def simple_factor(part: str, unit: str) -> float:
    """Factor of one simple unit with its prefix and exponent; ``unit`` is the whole, for the message."""
    match = FACTOR.match(part.translate(EXPONENTS))
    name, power = (match["name"], int(match["power"] or 1)) if match else (part, 1)
    if name in SIMPLE:
        return float(SIMPLE[name] ** power)
    for prefix, factor in PREFIXES.items():
        if name.startswith(prefix) and name[len(prefix) :] in PREFIXED:
            return float((factor * SIMPLE[name[len(prefix) :]]) ** power)
    raise UnknownUnit(unit)
