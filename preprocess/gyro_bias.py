"""A gyro's constant offset, as heading and gyro together tell it: taken off before the turning is smoothed.

A gyro whose zero is off turns its integral away from the compass steadily. As noise that contradicts the compass: a
search for noise levels may then believe the gyro to be all but exact, and set its samples aside a few at a time where
the compass pulls. The offset stays in the measured yaw rate, where a model of the sensor finds it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from preprocess.chains import Stream
from preprocess.integrated import integral_at
from preprocess.trial import FloatArray
from preprocess.turned import pieces

#: Turns are compared over pieces of this length, s; of one that is so many times as long, samples are missing.
PIECE, LONGEST = 5.0, 1.5
#: Fewer pieces than this tell nothing, nor fewer samples of the gyro in one.
FEWEST, SAMPLES = 12, 5
#: An offset is taken off from so many of its standard errors, and this size, rad/s, on: a smoother stands less.
STANDARD_ERRORS, LEAST = 6.0, 2e-3
#: Standard deviation of a normal variable over its median absolute deviation; standard error of a median of normals.
PER_MAD, OF_MEDIAN = 1.4826, 1.2533


def without_bias(streams: tuple[Stream, ...]) -> tuple[Stream, ...]:
    """Heading and yaw rate, the latter without an offset that is beyond doubt; others as they are."""
    if len(streams) != 2:
        return streams
    heading, gyro = streams
    rates = rates_apart(heading, gyro)
    if len(rates) < FEWEST:
        return streams
    bias = float(np.median(rates))
    error = OF_MEDIAN * PER_MAD * float(np.median(np.abs(rates - bias))) / np.sqrt(len(rates))
    if abs(bias) < max(STANDARD_ERRORS * error, LEAST):
        return streams
    return heading, replace(gyro, value=gyro.value - bias)


def rates_apart(heading: Stream, gyro: Stream) -> FloatArray:
    """Rate (n,) at which the gyro's integral leaves the heading over each piece that both cover, rad/s."""
    t, at = heading.t[heading.good], gyro.t[gyro.good]
    if min(len(t), len(at)) < FEWEST:
        return np.zeros(0)
    apart = integral_at(t, at, gyro.value[gyro.good, 0]) - heading.value[heading.good, 0]
    edges, covered = pieces(t, at, PIECE, LONGEST * PIECE, SAMPLES)
    return np.asarray((np.diff(apart[edges]) / np.diff(t[edges]))[covered], dtype=float)
