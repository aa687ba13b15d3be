"""Time stamps in the order of recording: midnight, restarts, and single stamps that are damaged."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ingest.canbus.frames import Capture
from ingest.clock import continue_clock
from ingest.log import Finding

#: A step larger than this, either way, is a jump.
JUMP_NS = 1_000_000_000
#: As many records with a wrong stamp in a row are taken for damage; more are a clock that was set.
MOST_WRONG = 3
#: A wrong stamp at an end of the log shows only by its distance.
FAR_NS = 60 * 1_000_000_000
#: No log spans more than this before and after its middle.
SPAN_NS = 200 * 86_400 * 1_000_000_000
DAY_NS = 86_400 * 1_000_000_000


def repaired(capture: Capture) -> Capture:
    """The capture with frames whose stamps are continuous; those with a damaged stamp are left out."""
    frames = capture.frames
    time_ns, kept, findings = repaired_times(frames.time_ns, capture.clock)
    frames = replace(frames if kept.all() else frames.take(kept), time_ns=time_ns)
    return replace(capture, frames=frames, findings=(*capture.findings, *findings))


def repaired_times(
    time_ns: NDArray[np.int64], clock: str
) -> tuple[NDArray[np.int64], NDArray[np.bool_], tuple[Finding, ...]]:
    """Continuous times, which records they belong to, and what was found.

    Parameters
    ----------
    time_ns : (n,) int64
    clock : str
        As in ``Capture``: ``"day"`` goes on over midnight.
    """
    if clock == "day":
        time_ns = time_ns + DAY_NS * np.cumsum(np.diff(time_ns, prepend=time_ns[:1]) < -DAY_NS // 2)
    kept = ~wrong_stamps(time_ns)
    count = int((~kept).sum())
    continued, findings = continue_clock(time_ns[kept] if count else time_ns)
    if count:
        message = f"{count} records with a time stamp that their neighbours contradict were left out"
        findings = [Finding("clock", message, count=count), *findings]
    return continued, kept, tuple(findings)


def wrong_stamps(time_ns: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Records whose stamp jumps away from those before and is back soon; (n,) bool."""
    if not len(time_ns):
        return np.zeros(0, np.bool_)
    absurd = np.abs(time_ns.astype(np.float64) - np.median(time_ns)) > SPAN_NS
    if absurd.any():
        wrong = absurd.copy()
        wrong[~absurd] = wrong_stamps(time_ns[~absurd])
        return wrong
    wrong = np.zeros(len(time_ns), np.bool_)
    steps = np.diff(time_ns)
    jumps = (np.flatnonzero(np.abs(steps) > JUMP_NS) + 1).tolist()
    for i, j in pairwise(jumps):
        away, back = int(steps[i - 1]), int(steps[j - 1])
        returned = abs(int(time_ns[j]) - int(time_ns[i - 1])) < min(abs(away), abs(back)) // 2
        if j - i <= MOST_WRONG and (away > 0) != (back > 0) and returned and not wrong[i - 1]:
            wrong[i:j] = True
    if jumps and len(time_ns) > 4 * MOST_WRONG:
        first, last = jumps[0], jumps[-1]
        wrong[:first] |= first <= MOST_WRONG and abs(int(steps[first - 1])) > FAR_NS
        wrong[last:] |= len(time_ns) - last <= MOST_WRONG and abs(int(steps[last - 1])) > FAR_NS
    return wrong
