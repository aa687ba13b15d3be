"""A population in lanes: eight candidates abreast, each product of factors formed once for all equations.

The terms' table is turned into a tape: a list of products of two earlier values each, in which equal parts are shared,
and for every equation a sum over the tape. Compiled once, like the kernel; the tape is data.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from identify.kernel import NX
from identify.structure import Table
from identify.term import FACTORS

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
PlaceArray = np.ndarray[tuple[int, ...], np.dtype[np.uint64]]

#: Candidates that run abreast.
LANES = 8
_FIRST_CHANNEL = len(FACTORS)
_TINY = 1e-3


@dataclass(frozen=True)
class Tape:
    """Products and sums that a table stands for.

    Attributes
    ----------
    left, right : (t,)
        Places of the two values of each product; factors and channels come first, then the products themselves.
    begin : (6,)
        Where each equation's summands begin.
    place, which : (m,)
        Of each summand: the value's place, and the coefficient that it is multiplied with.
    """

    left: PlaceArray
    right: PlaceArray
    begin: IntArray
    place: PlaceArray
    which: IntArray


def tape_of(table: Table) -> Tape:
    """Write a table's products as a tape."""
    base = _FIRST_CHANNEL + len(table.channels)
    known: dict[tuple[int, ...], int] = {}
    pairs: list[tuple[int, int]] = []

    def place(factors: tuple[int, ...]) -> int:
        if len(factors) < 2:
            return factors[0] if factors else 0
        if factors not in known:
            pair = place(factors[:-1]), factors[-1]
            pairs.append(pair)
            known[factors] = base + len(pairs) - 1
        return known[factors]

    places = np.array(
        [place(tuple(sorted(int(f) for f in row if f))) for row in table.product], dtype=np.uint64
    )
    order = np.argsort(table.equation, kind="stable")
    begin = np.searchsorted(table.equation[order], np.arange(6)).astype(np.int64)
    left, right = (np.array([p[k] for p in pairs], dtype=np.uint64) for k in (0, 1))
    return Tape(left, right, begin, places[order], np.asarray(table.which[order], dtype=np.int64))


def population_in_lanes(
    tape: Tape,
    first: FloatArray,
    h: float,
    channels: FloatArray,
    slopes: FloatArray,
    wind: FloatArray,
    current: FloatArray,
    u0: float,
    coefficients: FloatArray,
) -> FloatArray:
    """Free runs of candidates (m, p) from the same state, by the fourth-order rule of the kernel.

    Returns
    -------
    (m, n + 1, 8)
        What ran away is left as it is: large, infinite or NaN.
    """
    m, n = len(coefficients), len(channels)
    padded = np.zeros((-(-m // LANES) * LANES, len(tape.which)))
    padded[:m] = coefficients[:, tape.which]
    out = np.empty((len(padded), n + 1, NX))
    states = np.empty((n + 1, NX, LANES))
    for k in range(0, len(padded), LANES):
        lanes = np.ascontiguousarray(padded[k : k + LANES].T)
        _run(
            first,
            h,
            channels,
            slopes,
            wind,
            current,
            u0,
            tape.left,
            tape.right,
            tape.begin,
            tape.place,
            lanes,
            states,
        )
        out[k : k + LANES] = states.transpose(2, 0, 1)
    return out[:m]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})  # type: ignore[untyped-decorator]
def _factors(
    z: FloatArray, channels: FloatArray, slopes: FloatArray, part: float, wind: FloatArray, current: FloatArray,
    u0: float, q: FloatArray, rate: FloatArray,
) -> None:  # fmt: skip
    """Fill the factors ``q`` (k, LANES) at states ``z`` (8, LANES), and the rates of position and heading."""
    for lane in range(LANES):
        u, v = z[3, lane], z[4, lane]
        speed = math.sqrt(u * u + v * v)
        q[1, lane], q[2, lane], q[3, lane] = u, v, z[5, lane]
        q[4, lane], q[5, lane], q[6, lane] = abs(u), abs(v), abs(z[5, lane])
        q[7, lane], q[8, lane], q[9, lane] = speed, u - u0, 1.0 / max(speed, _TINY)
        q[10, lane], q[11, lane] = z[6, lane], z[7, lane]
    wn, we = wind[0] - current[0], wind[1] - current[1]
    for lane in range(LANES):
        c, s = math.cos(z[2, lane]), math.sin(z[2, lane])
        wx, wy = wn * c + we * s - z[3, lane], -wn * s + we * c - z[4, lane]
        air = math.sqrt(wx * wx + wy * wy)
        q[12, lane], q[13, lane] = air * wx, air * wy
        rate[0, lane] = z[3, lane] * c - z[4, lane] * s + current[0]
        rate[1, lane] = z[3, lane] * s + z[4, lane] * c + current[1]
        rate[2, lane] = z[5, lane]
    for k in range(channels.shape[0]):
        value = channels[k] + part * slopes[k]
        for lane in range(LANES):
            q[14 + k, lane] = value


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})  # type: ignore[untyped-decorator]
def _run(
    first: FloatArray, h: float, channels: FloatArray, slopes: FloatArray, wind: FloatArray, current: FloatArray,
    u0: float, left: PlaceArray, right: PlaceArray, begin: IntArray, place: PlaceArray, coefficients: FloatArray,
    states: FloatArray,
) -> None:  # fmt: skip
    """Fill ``states`` (n + 1, 8, LANES) for coefficients (m, LANES) in the order of the tape's summands."""
    n = channels.shape[0]
    q = np.zeros((14 + channels.shape[1] + left.shape[0], LANES))
    rate = np.zeros((4, NX, LANES))
    middle = np.empty((NX, LANES))
    for j in range(NX):
        for lane in range(LANES):
            states[0, j, lane] = first[j]
    for lane in range(LANES):
        q[0, lane] = 1.0
    for i in range(n):
        for stage in range(4):
            reach = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
            for j in range(NX):
                for lane in range(LANES):
                    middle[j, lane] = states[i, j, lane] + reach * rate[max(stage - 1, 0), j, lane]
            part = -1.0 if stage == 0 else (1.0 if stage == 3 else 0.0)
            _factors(middle, channels[i], slopes[i], part, wind[i], current, u0, q, rate[stage])
            for k in range(left.shape[0]):
                for lane in range(LANES):
                    q[14 + channels.shape[1] + k, lane] = q[left[k], lane] * q[right[k], lane]
            for e in range(5):
                for lane in range(LANES):
                    rate[stage, 3 + e, lane] = 0.0
                for k in range(begin[e], begin[e + 1]):
                    for lane in range(LANES):
                        rate[stage, 3 + e, lane] += coefficients[k, lane] * q[place[k], lane]
        for j in range(NX):
            for lane in range(LANES):
                states[i + 1, j, lane] = states[i, j, lane] + h / 6.0 * (
                    rate[0, j, lane] + 2.0 * rate[1, j, lane] + 2.0 * rate[2, j, lane] + rate[3, j, lane]
                )
