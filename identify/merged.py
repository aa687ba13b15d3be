"""Samples that a model cannot tell apart taken together: a sensor says at fifty hertz what a step says as well.

The mean of what was measured within half a step, or within a whole one where a sensor is faster than that, at the mean
of the times, weighted as the sensors are believed. Less what a curve's mean is off the curve at the mean time, by the
smoothed motion: nothing is lost but work, for sums over the samples are most of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from identify.stretch import STREAMS, Samples, Stretch

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Samples within this share of a step are taken together.
SHARE = 0.5
#: ... within all of it those of a sensor that usually says more than one thing in this share of it.
FAST = 0.6


def merged(stretch: Stretch) -> Stretch:
    """The stretch with the samples of every sensor within half a step, or a whole one, taken together."""
    samples = stretch.samples
    every = np.where(_fast(samples, FAST * stretch.h)[samples.kind], stretch.h, SHARE * stretch.h)
    place = np.floor((samples.t - stretch.start) / every).astype(np.int64)
    place = place * len(STREAMS) + samples.kind
    _, first, which = np.unique(place, return_index=True, return_inverse=True)
    if len(first) == len(place):
        return stretch
    motion = CubicSpline(stretch.grid, stretch.states)
    left = samples.value - _seen(motion, samples.t, samples.kind)
    mean = _means(replace(samples, value=left), first, which)
    return replace(stretch, samples=replace(mean, value=mean.value + _seen(motion, mean.t, mean.kind)))


def _fast(samples: Samples, interval: float) -> BoolArray:
    """Which kinds of samples usually come within an interval, s."""
    steps = [np.diff(samples.t[samples.kind == k]) for k in range(len(STREAMS))]
    return np.array([len(d) > 0 and float(np.median(d)) < interval for d in steps])


def _means(samples: Samples, first: IntArray, which: IntArray) -> Samples:
    """Weighted means of samples by ``which`` (m,) place each is in, ``first`` of each, in the order of their times."""
    weight = samples.sigma**-2.0
    total = np.bincount(which, weight)
    columns = (samples.t, *samples.value.T)
    t, *value = (np.bincount(which, weight * x) / total for x in columns)
    order = np.argsort(t, kind="stable")
    kind, sigma = samples.kind[first], 1.0 / np.sqrt(total)
    return replace(
        samples, t=t[order], kind=kind[order], value=np.column_stack(value)[order], sigma=sigma[order]
    )


def _seen(motion: CubicSpline, t: FloatArray, kind: IntArray) -> FloatArray:
    """What sensors of each kind (m,) at the origin would say (m, 2) at some times (m,), second column 0 for scalars."""
    x, y, psi, u, v, r = motion(t).T
    none = np.zeros_like(x)
    north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    first = np.choose(kind, [x, psi, r, north])
    second = np.choose(kind, [y, none, none, east])
    return np.column_stack([first, second])
