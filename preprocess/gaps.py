"""Unbroken stretches: where nothing was missing for longer than the dynamics allow to bridge."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from preprocess.chains import Segments
from preprocess.judge import Judged
from preprocess.run_of_log import LEAST_SECONDS as LEAST_SECONDS
from preprocess.trial import BoolArray, FloatArray
from preprocess.turns import untold
from preprocess.vessel import Vessel

#: Gaps up to this long are always bridged, s.
ALWAYS = 3.0
#: … and up to this many sample intervals.
INTERVALS = 5.0
#: A stretch needs this many samples of position and of heading, and ``LEAST_SECONDS``.
LEAST_SAMPLES = 10
#: Samples this many intervals (of the slower sensor) beside a segment are judged with it.
BESIDE = 1.5


def bridge(t: FloatArray, position: FloatArray, length: float) -> float:
    """Return the longest gap to bridge, s: the time to move by its own length, at least ``ALWAYS``.

    Parameters
    ----------
    t : (n,) s
    position : (n, 2) m
    length : float
        Of the vessel, m.
    """
    if len(t) < 3:
        return ALWAYS
    step = np.diff(t)
    speed = float(np.median(np.hypot(*np.diff(position, axis=0).T) / step))
    return max(ALWAYS, INTERVALS * float(np.median(step)), min(length / max(speed, 1e-3), 60.0))


def covered(t: FloatArray, broken: BoolArray) -> list[tuple[float, float]]:
    """Stretches (first and last time) of times (n,) between which nothing is ``broken`` (n - 1,)."""
    if not len(t):
        return []
    breaks = np.flatnonzero(broken)
    starts, ends = np.r_[0, breaks + 1], np.r_[breaks, len(t) - 1]
    return [(float(a), float(b)) for a, b in zip(t[starts], t[ends], strict=True)]


def intersect(a: list[tuple[float, float]], b: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Overlaps of two lists of intervals, each sorted and disjoint."""
    out, i, j = [], 0, 0
    while i < len(a) and j < len(b):
        low, high = max(a[i][0], b[j][0]), min(a[i][1], b[j][1])
        if low < high:
            out.append((low, high))
        if a[i][1] < b[j][1]:
            i += 1
        else:
            j += 1
    return out


def find_segments(judged: Mapping[str, Judged], vessel: Vessel) -> Segments:
    """Segments in which position and heading are there.

    A yaw rate bridges longer gaps of the heading; where nothing tells what was turned in one, and it may be half a turn
    or more, it is not bridged.
    """
    position, heading = judged["position"], judged["heading"]
    t, psi_t = position.raw.t[position.good], heading.raw.t[heading.good]
    longest = bridge(t, position.raw.value[position.good], vessel.length)
    lost = (np.diff(psi_t) > _heading_bridge(judged, psi_t, longest)) | untold(judged)
    stretches = intersect(covered(t, np.diff(t) > longest), covered(psi_t, lost))
    return tuple(s for s in stretches if _enough(s, t) and _enough(s, psi_t))


def narrowed(segments: Segments, judged: Mapping[str, Judged], vessel: Vessel) -> Segments:
    """Segments without what is left between no two good samples, once more of these were set aside.

    What lies before the first position that counts is carried back by a motion that is known from there on: a turning
    vessel may have gone any way.
    """
    return tuple(intersect(list(segments), list(find_segments(judged, vessel)))) if segments else segments


def _heading_bridge(judged: Mapping[str, Judged], t: FloatArray, longest: float) -> float:
    step = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    return max(longest, INTERVALS * step) * (3.0 if "yaw_rate" in judged else 1.0)


def _enough(stretch: tuple[float, float], t: FloatArray) -> bool:
    count = int(np.searchsorted(t, stretch[1], "right") - np.searchsorted(t, stretch[0]))
    return count >= LEAST_SAMPLES and stretch[1] - stretch[0] >= LEAST_SECONDS


def widened(segments: Segments, judged: Mapping[str, Judged]) -> Segments:
    """Segments with the samples that one sensor gives after the last, or before the first, of the other.

    They are not smoothed, but they are judged; neighbouring segments stay apart.
    """
    if not segments:
        return segments
    used = [judged[k].raw.t for k in ("position", "heading")]
    more = BESIDE * max(float(np.median(np.diff(t))) for t in used)
    low, high = np.array(segments).T
    room = 0.49 * np.r_[np.inf, low[1:] - high[:-1], np.inf]
    low, high = low - np.minimum(more, room[:-1]), high + np.minimum(more, room[1:])
    return tuple(zip(low.tolist(), high.tolist(), strict=True))
