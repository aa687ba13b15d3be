"""What an actuator makes of its command, on an even grid, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def first_order(series, dt, time_constant):
    """Response of a first-order lag, exact for a command that holds over each step; starts settled."""
    out = np.empty_like(series)
    keep = np.exp(-dt / time_constant) if time_constant > 1e-9 else 0.0
    value = series[0]
    for i in range(series.shape[0]):
        # mean over the step of the exact response keeps the timing right
        target = series[i]
        if time_constant > 1e-9:
            out[i] = target + (value - target) * time_constant / dt * (1.0 - keep)
        else:
            out[i] = target
        value = target + (value - target) * keep
    return out


@njit(cache=True, nogil=True)
def rate_limited(series, dt, rate):
    """Follow the command no faster than ``rate`` per second; starts settled."""
    out = np.empty_like(series)
    value = series[0]
    for i in range(series.shape[0]):
        before = value
        value += min(max(series[i] - value, -rate * dt), rate * dt)
        out[i] = 0.5 * (before + value) if abs(series[i] - before) > rate * dt else series[i]
    return out


@njit(cache=True, nogil=True)
def play(series, width, begin):
    """Backlash: the output stays until the input has crossed the half-width, then is dragged along.

    ``begin``, -1 to 1, is where in the slack it is at first.
    """
    out = np.empty_like(series)
    value = series[0] + begin * width
    for i in range(series.shape[0]):
        value = min(max(value, series[i] - width), series[i] + width)
        out[i] = value
    return out


@njit(cache=True, nogil=True)
def deadband_neutral(series, width, shifted):
    """No response within ± the half-width of zero; outside, as commanded, or less the half-width (``shifted``)."""
    out = np.empty_like(series)
    for i in range(series.shape[0]):
        beyond = abs(series[i]) - width
        out[i] = 0.0 if beyond <= 0 else (np.sign(series[i]) * beyond if shifted else series[i])
    return out
