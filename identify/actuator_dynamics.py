"""What an actuator makes of its command, on an even grid, compiled.

A command is given by its means ``series`` (n,) over the steps of ``dt``, and by what the mean of its c·|c| is more than
that of the mean, ``surge`` (n,): not nothing where it switched within the step, at the time that the means tell. What
follows it begins there, not at the step's begin or end. Each function returns the same two of the actuator. Where that
depends on what it was told before, this is given by values and how long each held, ``told`` and ``lasted`` (m,).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
_COMPILED = {"cache": True, "nogil": True, "error_model": "numpy"}


@dataclass(frozen=True)
class Before:
    """What an input was before a stretch: values (m,), and how long each held, s (m,), the last until it begins.

    ``begin`` is where it was when it was first told anything: a linkage in its slack, -1 to 1 of its width; what
    follows late, so far from what it was told, in the input's unit.
    """

    told: FloatArray
    lasted: FloatArray
    begin: float = 0.0


@njit(**_COMPILED)
def _switch(series, surge, i, held):
    """Share of step ``i`` for which the command stays where it was, and where it is afterwards."""
    here = series[i]
    if surge[i] == 0.0:
        return 0.0, here
    after = series[i + 1] if i + 1 < series.shape[0] else here
    if (here - held) * (after - here) > 0.0:
        return (after - here) / (after - held), after
    return 0.0, here


@njit(**_COMPILED)
def _kept(time, constant, at_a_rate):
    """What a lag leaves of a distance after some time; nothing that counts at a rate."""
    return 0.0 if at_a_rate or constant < 1e-9 else math.exp(-time / constant)


@njit(**_COMPILED)
def _squared(target, off, time, constant, keep):
    """Integral of the square of what comes to a target from so far off, of which ``keep`` is left after some time."""
    square = target * target * time + 2.0 * target * off * constant * (1.0 - keep)
    return square + 0.5 * off * off * constant * (1.0 - keep * keep)


@njit(**_COMPILED)
def _lagging(value, target, time, constant, keep):
    """Value after some time, which ``keep`` is left of, and the integrals of the value and of its square with sign."""
    if constant < 1e-9:
        return target, target * time, target * abs(target) * time
    off = value - target
    end = target + off * keep
    total = target * time + off * constant * (1.0 - keep)
    if value * end >= 0.0:
        return end, total, math.copysign(_squared(target, off, time, constant, keep), value + end)
    crossed = -target / off
    early = -constant * math.log(crossed)
    before = _squared(target, off, early, constant, crossed)
    after = _squared(target, -target, time - early, constant, keep / crossed)
    return end, total, math.copysign(before, value) + math.copysign(after, end)


@njit(**_COMPILED)
def _moving(value, target, time, rate):
    """Value after some time at no more than a rate, and the integrals of the value and of its square with sign."""
    if time <= 0.0:
        return value, 0.0, 0.0
    way = target - value
    moving = min(abs(way) / rate, time)
    end = target if moving < time else value + math.copysign(rate * moving, way)
    total = 0.5 * (value + end) * moving + end * (time - moving)
    square = end * abs(end) * (time - moving)
    if moving > 0.0:
        square += (abs(end) ** 3 - abs(value) ** 3) / (3.0 * math.copysign(rate, way))
    return end, total, square


@njit(**_COMPILED)
def _on(value, target, time, limit, at_a_rate, keep):
    """``_moving`` or ``_lagging``."""
    if at_a_rate:
        return _moving(value, target, time, limit)
    return _lagging(value, target, time, limit, keep)


@njit(**_COMPILED)
def _both(share, before, after):
    """Mean over a step of what switches at ``share`` of it, and what that of its square with sign is more."""
    mean = share * before + (1.0 - share) * after
    return mean, share * before * abs(before) + (1.0 - share) * after * abs(after) - mean * abs(mean)


@njit(**_COMPILED)
def _followed(series, surge, dt, limit, at_a_rate, told, lasted, begin):
    """The command followed at a limited rate, or with a lag, from ``begin`` off what it was first told."""
    out, more = np.empty_like(series), np.empty_like(series)
    held = series[0]
    value = (told[0] if told.shape[0] else held) + begin
    for i in range(told.shape[0]):
        value, _, _ = _on(value, told[i], lasted[i], limit, at_a_rate, _kept(lasted[i], limit, at_a_rate))
    whole = _kept(dt, limit, at_a_rate)
    for i in range(series.shape[0]):
        share, after = _switch(series, surge, i, held)
        one, square, keep = 0.0, 0.0, whole
        if share > 0.0:
            early = _kept(share * dt, limit, at_a_rate)
            keep = _kept((1.0 - share) * dt, limit, at_a_rate)
            value, one, square = _on(value, held, share * dt, limit, at_a_rate, early)
        value, two, rest = _on(value, after, (1.0 - share) * dt, limit, at_a_rate, keep)
        held = after
        out[i] = (one + two) / dt
        more[i] = (square + rest) / dt - out[i] * abs(out[i])
    return out, more


def first_order(
    series: FloatArray,
    surge: FloatArray,
    dt: float,
    time_constant: float,
    told: FloatArray,
    lasted: FloatArray,
    begin: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Response of a first-order lag, ``begin`` off when it was first told anything."""
    out, more = _followed(series, surge, dt, time_constant, False, told, lasted, begin)
    return out, more


def rate_limited(
    series: FloatArray,
    surge: FloatArray,
    dt: float,
    rate: float,
    told: FloatArray,
    lasted: FloatArray,
    begin: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Follow the command no faster than ``rate`` per second, ``begin`` off when it was first told anything."""
    out, more = _followed(series, surge, dt, rate, True, told, lasted, begin)
    return out, more


@njit(**_COMPILED)
def play(series, surge, width, begin, told):
    """Backlash: the output stays until the input has crossed the half-width, then is dragged along.

    ``begin``, -1 to 1, is where in the slack it was when it was first told anything.
    """
    out, more = np.empty_like(series), np.empty_like(series)
    held = series[0]
    value = (told[0] if told.shape[0] else held) + begin * width
    for earlier in told:
        value = min(max(value, earlier - width), earlier + width)
    for i in range(series.shape[0]):
        share, after = _switch(series, surge, i, held)
        before = min(max(value, held - width), held + width)
        value = min(max(before, after - width), after + width)
        held = after
        out[i], more[i] = _both(share, before, value)
    return out, more


@njit(**_COMPILED)
def _neutral(command, width, shifted):
    beyond = abs(command) - width
    return 0.0 if beyond <= 0.0 else (math.copysign(beyond, command) if shifted else command)


@njit(**_COMPILED)
def deadband_neutral(series, surge, width, shifted):
    """No response within ± the half-width of zero; outside, as commanded, or less the half-width (``shifted``)."""
    out, more = np.empty_like(series), np.empty_like(series)
    held = series[0]
    for i in range(series.shape[0]):
        share, after = _switch(series, surge, i, held)
        before, value = _neutral(held, width, shifted), _neutral(after, width, shifted)
        held = after
        out[i], more[i] = _both(share, before, value)
    return out, more


@njit(**_COMPILED)
def displaced(series, surge, offset):
    """The command, and ``offset`` more."""
    out, more = np.empty_like(series), np.empty_like(series)
    held = series[0]
    for i in range(series.shape[0]):
        share, after = _switch(series, surge, i, held)
        out[i], more[i] = _both(share, held + offset, after + offset)
        held = after
    return out, more
