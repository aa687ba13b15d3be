"""What a hull that is run freely is held against: samples of the sensors, at most one of each per step, and inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from preprocess.chains import Segments, Stream, inside
from preprocess.kalman import IntArray
from preprocess.trial import FloatArray, Measurement

#: Sensors, and the places of what they show among x, y, ψ, u, v, r.
SHOWN = {"position": (0, 1), "heading": (2,), "yaw_rate": (5,)}
#: A step in the offset of the inputs by which their change with it is found, s.
SMALL = 0.05


@dataclass(frozen=True)
class Seen:
    """Samples of one sensor: stamps (n,) s, values (n, m), standard deviations (n,)."""

    name: str
    t: FloatArray
    value: FloatArray
    sigma: FloatArray


@dataclass(frozen=True)
class Acting:
    """Integrals of c, |c|c and c² of an input at knots (n,): (3, n), for exact averages over any interval."""

    t: FloatArray
    parts: FloatArray

    def means(self, edges: FloatArray) -> FloatArray:
        """Averages between edges (n,): (n - 1, 3)."""
        width = np.diff(edges)
        return np.column_stack([np.diff(np.interp(edges, self.t, part)) / width for part in self.parts])


def acting(m: Measurement) -> Acting:
    """An input, held or straight between its samples; its first and last values hold on."""
    at, value = m.t[m.good], m.value[m.good]
    at, value = np.r_[at[0] - 100.0, at, at[-1] + 100.0], np.r_[value[0], value, value[-1]]
    level = value[:-1] if m.held else 0.5 * (value[1:] + value[:-1])
    parts = [np.r_[0.0, np.cumsum(x * np.diff(at))] for x in (level, np.abs(level) * level, level**2)]
    return Acting(at, np.stack(parts))


def forces(inputs: Sequence[Acting], edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Averages of all inputs between edges (n - 1, inputs, 3), and how they change with later edges, per second."""
    at = np.stack([edges, edges + SMALL, edges - SMALL])
    means, width = np.empty((3, len(edges) - 1, len(inputs), 3)), np.diff(at)
    for k, i in enumerate(inputs):
        for j, part in enumerate(i.parts):
            means[:, :, k, j] = np.diff(np.interp(at, i.t, part)) / width
    here, ahead, behind = means
    return here, (ahead - behind) / (2.0 * SMALL)


def seen(stream: Stream, states: pd.DataFrame, segments: Segments, step: float) -> Seen:
    """Good samples of a sensor, averaged within steps as errors about the smoothed motion: nothing is blurred."""
    use = stream.good & (inside(stream.t, segments) >= 0)
    t, value = stream.t[use], stream.value[use]
    weight = np.ones(len(t)) if stream.weight is None else 1.0 / stream.weight[use]
    _, bin_of = np.unique(np.floor(t / step), return_inverse=True)
    total = np.bincount(bin_of, weight)
    at = np.bincount(bin_of, weight * t) / total
    columns = []
    for k, name in enumerate({0: ("x", "y"), 2: ("psi",), 5: ("r",)}[SHOWN[stream.name][0]]):
        about = np.interp(t, states["t"], states[name])
        error = np.bincount(bin_of, weight * (value[:, k] - about)) / total
        columns.append(np.interp(at, states["t"], states[name]) + error)
    return Seen(stream.name, at, np.column_stack(columns), stream.sigma / np.sqrt(total))


def motion_at(
    states: pd.DataFrame, t: FloatArray, off: float, current: FloatArray, mounting: FloatArray
) -> FloatArray:
    """x, y, ψ, u, v, r of the smoothed motion (n, 6), u and v through the water.

    The positions' stamps are moved back by ``off``; ``mounting`` (3,) is where the antenna is, forward and to
    starboard, and how far the compass is turned.
    """
    known = states["t"].to_numpy()
    psi, r = (np.interp(t, known, states[k]) for k in ("psi", "r"))
    x, y, u, v, shown = (np.interp(t + off, known, states[k]) for k in ("x", "y", "u", "v", "psi"))
    north = u * np.cos(shown) - v * np.sin(shown) - current[0]
    east = u * np.sin(shown) + v * np.cos(shown) - current[1]
    ahead, abeam, turned = mounting
    psi = psi - turned
    c, s = np.cos(psi), np.sin(psi)
    x, y = x - ahead * c + abeam * s, y - ahead * s - abeam * c
    return np.column_stack([x, y, psi, north * c + east * s + r * abeam, east * c - north * s - r * ahead, r])


def windows_of(segments: Segments, length: float) -> list[tuple[float, float]]:
    """The segments in even windows of about a length, s."""
    out = []
    for a, b in segments:
        edges = np.linspace(a, b, max(round((b - a) / length), 1) + 1)
        out += list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    return out


def blocks_of(t: FloatArray, count: int) -> list[IntArray]:
    """Indices of samples in the order of time, in so many blocks of equal number."""
    return list(np.array_split(np.argsort(t, kind="stable"), count))
