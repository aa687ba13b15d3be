"""The causal observer: motion so far, from samples as they come, at their own uneven times.

Two Kalman filters on integrated Wiener processes, as in `preprocess.kalman`: one of the heading (ψ, r, ṙ), one of the
track (north and east alike; position, velocity, acceleration). The antenna's arm is taken off with the heading that is
known by then. Every sample is judged by its innovation before it is taken. Cost and memory per sample are constant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from preprocess.trial import BoolArray, FloatArray
from preprocess.wiener import predict, update

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Kinds of rows.
POSITION, HEADING, YAW_RATE, VELOCITY = 0, 1, 2, 3
#: A sample is set aside where its innovation is this many standard deviations off. Two in a row that agree with each
#: other better than with the filter are believed: the vessel was driven harder than usual. More than so many in a row,
#: over so many seconds, are believed in any case: then the filter was wrong.
GATE, PATIENCE, PATIENCE_S = 6.0, 5, 1.0
#: Two agree where they differ by less than this share of what the second is off the filter.
AGREE = 0.35
#: Columns of what is observed.
COLUMNS = ("x", "y", "psi", "u", "v", "r")


@dataclass(frozen=True)
class CausalLevels:
    """What the observer knows of sensors and vessel.

    Attributes
    ----------
    q_heading, q_track : float
        Intensity of the white third derivative, rad²/s⁵ and m²/s⁵.
    sigma : (4,)
        White noise of position, heading, yaw rate and velocity, SI; NaN where there is no such sensor.
    rate : (2,)
        Typical yaw rate, rad/s, and speed, m/s: what is expected of a vessel of which nothing is known yet.
    antenna : (forward, starboard) m
    """

    q_heading: float
    q_track: float
    sigma: tuple[float, float, float, float]
    rate: tuple[float, float]
    antenna: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Rows:
    """Samples in the order of time: ``t`` (n,) s, ``kind`` (n,), ``value`` (n, 2) SI, NED."""

    t: FloatArray
    kind: IntArray
    value: FloatArray


@dataclass(frozen=True)
class Observed:
    """What was known after each row.

    Attributes
    ----------
    t : (n,) s
    state : (n, 6)
        x, y, ψ (unwrapped), u, v (over ground), r; NaN until position and heading have come.
    variance : (n, 3)
        Of velocity per component, yaw rate and position per component.
    good : (n,) bool
        Whether the sample was believed.
    value : (n, 2)
        The samples, the heading moved by whole turns beside ψ.
    """

    t: FloatArray
    state: FloatArray
    variance: FloatArray
    good: BoolArray
    value: FloatArray


class CausalObserver:
    """Two filters that go on from where the last rows left them."""

    def __init__(self, levels: CausalLevels) -> None:
        self.levels = levels
        self._heading = np.zeros((3, 1)), np.zeros((3, 3))
        self._track = np.zeros((3, 2)), np.zeros((3, 3))
        # times of both filters, and per kind: samples refused in a row, time of the first, values of the last
        self._clock = np.full(2, np.nan)
        self._refused = np.zeros((4, 4))

    def take(self, rows: Rows) -> Observed:
        """Filter rows that come after all that came before (equal times may come in any order)."""
        n = len(rows.t)
        state, variance, good = np.full((n, 6), np.nan), np.full((n, 3), np.nan), np.zeros(n, bool)
        value = np.array(rows.value, dtype=float)
        levels = self.levels
        _filter(
            rows.t, rows.kind, value, np.nan_to_num(np.array(levels.sigma), nan=1.0) ** 2,
            levels.q_heading, levels.q_track, np.array(levels.rate), np.array(levels.antenna),
            *self._heading, *self._track, self._clock, self._refused, state, variance, good,
        )  # fmt: skip
        return Observed(rows.t, state, variance, good, value)


@njit(cache=True)
def _begin(m, p, order, value, variance, rate):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Begin a filter with its first sample; what was not measured is unknown within what is usual."""
    usual = (1e12, rate * rate, rate * rate)
    for i in range(3):
        for k in range(m.shape[1]):
            m[i, k] = value[k] if i == order else 0.0
        for j in range(3):
            p[i, j] = 0.0
        p[i, i] = variance if i == order else usual[i]


@njit(cache=True)
def _agrees(refused, row, expected, width):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Whether a sample that does not fit confirms the one before it, which did not either."""
    apart, off = 0.0, 0.0
    for j in range(width):
        apart = max(apart, abs(row[j] - refused[2 + j]))
        off = max(off, abs(row[j] - expected[j]))
    return refused[0] > 0.0 and apart < AGREE * off


@njit(cache=True)
def _refuse(refused, kind, t):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Count a sample that does not fit; True where so many did not that the filter must be wrong."""
    if refused[kind, 0] == 0.0:
        refused[kind, 1] = t
    refused[kind, 0] += 1.0
    return refused[kind, 0] > PATIENCE and t - refused[kind, 1] > PATIENCE_S


@njit(cache=True)
def _filter(  # type: ignore[no-untyped-def]  # noqa: ANN202
    t, kind, value, noise, q_heading, q_track, rate, antenna,  # noqa: ANN001
    mh, ph, mt, pt, clock, refused,  # noqa: ANN001
    state, variance, good,  # noqa: ANN001
):  # fmt: skip
    work, gain = np.zeros((3, 3)), np.zeros(3)
    row = np.zeros(2)
    for i in range(len(t)):
        k = kind[i]
        angular = k in (HEADING, YAW_RATE)
        which = 0 if angular else 1
        order = 0 if k in (HEADING, POSITION) else 1
        m, p = (mh, ph) if angular else (mt, pt)
        q = q_heading if angular else q_track
        row[0], row[1] = value[i, 0], value[i, 1]
        known = not np.isnan(clock[which])
        if known:
            dt = max(t[i] - clock[which], 0.0)
            predict(m, p, dt, q, work)
            clock[which] = t[i]
        if k == HEADING and known:
            row[0] += 2.0 * math.pi * np.round((m[0, 0] - row[0]) / (2.0 * math.pi))
            value[i, 0] = row[0]
        usable = True
        if not angular:
            usable = not np.isnan(clock[0])
            psi, r = mh[0, 0], mh[1, 0]
            c, s = math.cos(psi), math.sin(psi)
            if k == POSITION:
                row[0] -= c * antenna[0] - s * antenna[1]
                row[1] -= s * antenna[0] + c * antenna[1]
            else:
                row[0] -= r * (-s * antenna[0] - c * antenna[1])
                row[1] -= r * (c * antenna[0] - s * antenna[1])
        width = 1 if angular else 2
        if usable and not known:
            if order == 0:
                _begin(m, p, order, row, noise[k], rate[which])
                clock[which] = t[i]
                good[i] = True
        elif usable:
            spread = p[order, order] + noise[k]
            off = 0.0
            for j in range(width):
                off = max(off, (row[j] - m[order, j]) ** 2 / spread)
            if off > GATE * GATE and _agrees(refused[k], row, m[order], width):
                p[order, order] += off * spread  # the filter was wrong by as much
                off = 0.0
            if off <= GATE * GATE:
                good[i] = True
                refused[k, 0] = 0.0
                update(m, p, order, row, noise[k], gain)
            elif _refuse(refused, k, t[i]) and order == 0:
                _begin(m, p, order, row, noise[k], rate[which])
                refused[k, 0] = 0.0
                good[i] = True
            else:
                refused[k, 2], refused[k, 3] = row[0], row[1]
                if refused[k, 0] > 20 * PATIENCE:
                    refused[k, 0] = 0.0
        if not np.isnan(clock[0]) and not np.isnan(clock[1]):
            a, b = t[i] - clock[0], t[i] - clock[1]
            psi = mh[0, 0] + a * mh[1, 0] + 0.5 * a * a * mh[2, 0]
            c, s = math.cos(psi), math.sin(psi)
            north = mt[1, 0] + b * mt[2, 0]
            east = mt[1, 1] + b * mt[2, 1]
            for j in range(2):
                state[i, j] = mt[0, j] + b * mt[1, j] + 0.5 * b * b * mt[2, j]
            state[i, 2] = psi
            state[i, 3], state[i, 4] = c * north + s * east, -s * north + c * east
            state[i, 5] = mh[1, 0] + a * mh[2, 0]
            variance[i, 0], variance[i, 1], variance[i, 2] = pt[1, 1], ph[1, 1], pt[0, 0]
