"""How a gyro differs from the smoothed yaw rate, or a compass from the heading: by scale, bias and clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A sensor is looked for this far before and behind what was smoothed, s.
LATEST = 5.0
#: It is late only where that lessens its squared differences by so many of the noise's.
CLEARLY = 9.0


@dataclass(frozen=True)
class SensorLine:
    """Slope, offset in rad/s or rad, and lateness in s of what a sensor said over what was smoothed."""

    slope: float = 1.0
    offset: float = 0.0
    late: float = 0.0


def sensor_line(
    t: FloatArray, said: FloatArray, sigma: FloatArray, grid: FloatArray, smooth: FloatArray
) -> SensorLine:
    """The line of a sensor's samples ``said`` (m,) at ``t`` (m,), noise ``sigma`` (m,), over what is smooth on a grid.

    Where the smoother followed the sensor this is slope 1, offset 0, not late.
    """
    if len(t) == 0:
        return SensorLine()
    step = float(grid[1] - grid[0])
    lags = step * np.arange(-round(LATEST / step), round(LATEST / step) + 1)
    left = np.array([_line(t - lag, said, sigma, grid, smooth)[1] for lag in lags])
    best = int(np.argmin(left))
    lag = float(lags[best]) + step * _vertex(left, best)
    line, least = _line(t - lag, said, sigma, grid, smooth)
    if left[len(lags) // 2] - least < CLEARLY * float(np.mean(sigma**2)):
        return _line(t, said, sigma, grid, smooth)[0]
    return SensorLine(line.slope, line.offset, lag)


def _line(
    t: FloatArray, said: FloatArray, sigma: FloatArray, grid: FloatArray, smooth: FloatArray
) -> tuple[SensorLine, float]:
    """The line over what is ``smooth`` at ``t``, and the squared differences from it."""
    smoothed = np.interp(t, grid, smooth)
    about = smoothed - smoothed.mean()
    slope = 1.0 + float(about @ (said - smoothed)) / (float(about @ about) + float(np.sum(sigma**2)))
    offset = float(said.mean() - slope * smoothed.mean())
    return SensorLine(slope, offset), float(np.sum((said - slope * smoothed - offset) ** 2))


def _vertex(left: FloatArray, best: int) -> float:
    """Where between its neighbours a parabola through the least of some values is lowest, in steps."""
    if not 0 < best < len(left) - 1:
        return 0.0
    before, here, after = left[best - 1 : best + 2]
    bend = float(before - 2.0 * here + after)
    return 0.5 * float(before - after) / bend if bend > 0.0 else 0.0
