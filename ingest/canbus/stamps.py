"""Time stamps of frames in the order of recording, over midnight and restarts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ingest.canbus.frames import Capture
from ingest.clock import continue_clock
from ingest.log import Finding
from ingest.wrong_stamps import wrong_stamps

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
