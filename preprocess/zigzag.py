"""The two angles of a zigzag: how far the rudder is put over, and the heading at which that is ordered.

The order is given before the rudder leaves one side, not where it passes amidships: a vessel turns on meanwhile. From
one order to the next the heading goes from the one switching heading to the other, twice the angle, whatever the base
course is; so a log that begins in mid-zigzag, or holds two on different courses, tells it as well. The first order is
told from the base course. By the time that the rudder moves the vessel has turned a little on: an angle that is
usually ordered (ITTC 7.5-04-02-01) is named in place of one just beyond it.
"""

from __future__ import annotations

import numpy as np

from preprocess.kalman import IntArray
from preprocess.trial import FloatArray

#: Percentile of the rudder's angles that is as far as it goes: a sample beyond may be a wild one.
FARTHEST = 95.0
#: Share of the angle beyond which the rudder is over; back within half of that it is about amidships.
OVER = 0.5
#: Share of the way amidships by which it has left its side for good: it trembles less.
LEFT = 0.1
#: Share of the heading, and degrees, that orders differ by where a helmsman or a noisy log gives them; share of them
#: (of two at least) that agree within that where there is such a heading at all.
SCATTER, LEAST_SCATTER, AGREEING, LEAST_ORDERS = 0.15, 1.0, 2.0 / 3.0, 2
#: Share of its angle by which a rudder that is over moves, and of that time that it does not move by more: one slower
#: than the vessel is ordered back before it is there.
SWAYS, HELD = 0.05, 0.5
#: Smaller angles, degrees, are none.
LEAST = 0.5
#: Headings at which the rudder is usually ordered over, degrees; how far the vessel may have turned on as it moves, and
#: how far before the heading may have been read, as shares and degrees.
USUAL = np.array([1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0])
LATE, LEAST_LATE, EARLY, LEAST_EARLY = 0.1, 1.5, 0.05, 0.25


def zigzag_angles(t: FloatArray, psi: FloatArray, steer: FloatArray, every: float = 0.0) -> str:
    """Rudder angle and heading at which it is ordered over, as in "20/10", degrees; empty where they cannot be told.

    Parameters
    ----------
    t, psi, steer : (n,) s, rad, rad
    every : float
        Time between the samples of the rudder, s: where the vessel turns on by much meanwhile nothing is told.
    """
    if not (len(t) and np.isfinite(psi).all() and np.isfinite(steer).all()):
        return ""
    size = np.degrees(np.abs(steer))
    rudder = _agreed(size[size >= OVER * np.percentile(size, FARTHEST)], HELD, SWAYS)
    turned, unsure = (np.degrees(x) for x in _turned(t, psi, steer, every))
    switch = _agreed(turned, AGREEING, SCATTER) if len(turned) >= LEAST_ORDERS else 0.0
    if len(turned) and float(np.median(unsure)) > max(SCATTER * switch, LEAST_SCATTER):
        return ""
    return f"{rudder:.0f}/{_ordered(switch):.0f}" if min(rudder, switch) >= LEAST else ""


def _agreed(angles: FloatArray, share: float, scatter: float) -> float:
    """The median, degrees; 0 where less than a share of the angles agree with it."""
    middle = float(np.median(angles))
    agree = np.abs(angles - middle) <= max(scatter * middle, LEAST_SCATTER)
    return middle if agree.mean() >= share else 0.0


def _ordered(switch: float) -> float:
    """The usual angle just before the one at which the rudder moved, degrees; that itself where there is none."""
    past = switch - USUAL
    near = (past <= max(LATE * switch, LEAST_LATE)) & (past >= -max(EARLY * switch, LEAST_EARLY))
    return float(USUAL[near][-1]) if near.any() else switch


def _turned(t: FloatArray, psi: FloatArray, steer: FloatArray, every: float) -> tuple[FloatArray, FloatArray]:
    """Angle (k,) between the base course and each order, rad: half of what lies between one and the next.

    And how far it turned in half the time ``every`` after each order.
    """
    low, high = np.percentile(steer, [100.0 - FARTHEST, FARTHEST])
    away = (steer - 0.5 * (low + high)) / max(0.5 * (high - low), 1e-12)
    over = np.flatnonzero(np.abs(away) > OVER)
    last = np.flatnonzero(np.diff(np.sign(away[over])) != 0)
    gone = [1.0 - away * np.sign(away[over[k]]) for k in last]
    times = np.array([_left(t, x, over[k], over[k + 1]) for k, x in zip(last, gone, strict=True)])
    headings = np.interp(times, t, psi)
    base = psi[_amidships(away, over)][-1:]
    from_base = np.abs(headings[: len(base)] - base[: len(headings)])
    later = np.abs(np.interp(times + 0.5 * every, t, psi) - headings)
    return np.concatenate([from_base, 0.5 * np.abs(np.diff(headings))]), later


def _amidships(away: FloatArray, over: IntArray) -> IntArray:
    """Where the rudder was about amidships before it was first put over."""
    return np.flatnonzero(np.abs(away[: over[0] if len(over) else 0]) < 0.5 * OVER)


def _left(t: FloatArray, gone: FloatArray, last: int, then: int) -> float:
    """When the rudder left its side, by the times when it was ``gone`` by ``LEFT`` and by half of the way amidships.

    Beyond its side it is gone by less than nothing: over at ``last`` and on the other side ``then``, it is half-way
    between the two.
    """
    last -= int(np.argmax(gone[last::-1] <= LEFT))
    middle = last + int(np.argmax(gone[last : then + 1] > OVER))
    begun, half = (
        float(np.interp(x, gone[k : k + 2], t[k : k + 2])) for k, x in ((last, LEFT), (middle - 1, OVER))
    )
    return begun - (half - begun) * LEFT / (OVER - LEFT)
