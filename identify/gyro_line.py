"""How a gyro's own word differs from the smoothed yaw rate: by scale, bias and clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A gyro is looked for this far before and behind the smoothed yaw rate, s.
LATEST = 5.0
#: It is late only where that lessens its squared differences by so many of the noise's.
CLEARLY = 9.0


@dataclass(frozen=True)
class GyroLine:
    """Slope, offset in rad/s and lateness in s of what a gyro said over the smoothed yaw rate."""

    slope: float = 1.0
    offset: float = 0.0
    late: float = 0.0


def gyro_line(
    t: FloatArray, said: FloatArray, sigma: FloatArray, grid: FloatArray, rate: FloatArray
) -> GyroLine:
    """The line of a gyro's samples ``said`` (m,) at ``t`` (m,), noise ``sigma`` (m,), over a smoothed rate on a grid.

    Where the smoother followed the gyro this is slope 1, offset 0, not late.
    """
    if len(t) == 0:
        return GyroLine()
    step = float(grid[1] - grid[0])
    lags = step * np.arange(-round(LATEST / step), round(LATEST / step) + 1)
    left = np.array([_line(t - lag, said, sigma, grid, rate)[1] for lag in lags])
    noise = float(np.mean(sigma**2))
    best = int(np.argmin(left))
    if left[len(lags) // 2] - left[best] < CLEARLY * noise:
        return _line(t, said, sigma, grid, rate)[0]
    lag = float(lags[best]) + step * _vertex(left, best)
    line, _ = _line(t - lag, said, sigma, grid, rate)
    return GyroLine(line.slope, line.offset, lag)


def _line(
    t: FloatArray, said: FloatArray, sigma: FloatArray, grid: FloatArray, rate: FloatArray
) -> tuple[GyroLine, float]:
    """The line over the smoothed rate at ``t``, and the squared differences from it."""
    smoothed = np.interp(t, grid, rate)
    about = smoothed - smoothed.mean()
    slope = 1.0 + float(about @ (said - smoothed)) / (float(about @ about) + float(np.sum(sigma**2)))
    offset = float(said.mean() - slope * smoothed.mean())
    return GyroLine(slope, offset), float(np.sum((said - slope * smoothed - offset) ** 2))


def _vertex(left: FloatArray, best: int) -> float:
    """Where between its neighbours a parabola through the least of some values is lowest, in steps."""
    if not 0 < best < len(left) - 1:
        return 0.0
    before, here, after = left[best - 1 : best + 2]
    bend = float(before - 2.0 * here + after)
    return 0.5 * float(before - after) / bend if bend > 0.0 else 0.0
