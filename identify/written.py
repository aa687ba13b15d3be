"""Numbers as a person reads them: no more digits than their error lets count, and a true minus sign."""

from __future__ import annotations

import math

#: The last decimal that is written out, and the smallest and largest number; beyond, powers of ten.
FINEST, SMALL, LARGEST = -7, 1e-3, 1e6


def number(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits and a true minus sign; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    if 1e-4 <= abs(value) < 1e5:
        decimals = max(0, digits - 1 - int(f"{value:.{digits - 1}e}".split("e")[1]))
        return f"{value:.{decimals}f}".replace("-", "−")
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·10{superscript(int(power))}".replace("-", "−")


def superscript(value: int) -> str:
    """An integer in superscript digits."""
    return str(value).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def plus_minus(value: float | None, error: float | None) -> str:
    """``0.178 ± 0.004``: the value to the last digit that its error lets count."""
    if error is None or not math.isfinite(error) or error <= 0 or value is None or not math.isfinite(value):
        return number(value, 4)
    last = last_digit(error)
    if beyond_decimals(last, max(abs(value), error)):
        return f"{number(value, 4)} ± {number(error, 2)}"
    decimals = max(0, -last)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", "−")


def beyond_decimals(last: int, largest: float) -> bool:
    """Whether numbers up to ``largest`` with this last digit read better as powers of ten."""
    return last < FINEST or largest >= LARGEST or (largest < SMALL and last < -5)


def last_digit(error: float) -> int:
    """Power of ten of the last digit worth writing: two digits of an error that begins with 1-3, else one."""
    power = math.floor(math.log10(error))
    return power - 1 if error < 3.55 * 10.0**power else power
