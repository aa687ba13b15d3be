"""Blocks of records that a log holds twice in a row, as a buffer that was written again leaves them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ingest.log import Finding

BoolArray = NDArray[np.bool_]

#: So many steps back of a clock are looked at.
MOST_STEPS = 100


def repeated(t_ns: NDArray[np.int64], known: BoolArray, alike: Callable[[int, int, int], bool]) -> BoolArray:
    """Which records (n,) stand in the second of two equal blocks that follow one another.

    A time that comes twice with all that goes with it is no clock that was set back: what follows is the same again.

    Parameters
    ----------
    t_ns : (n,) int64
        Times in the order of recording.
    known : (n,) bool
        Records that state a time.
    alike : callable
        Whether as many records from one place as from another are the same, byte for byte: ``alike(a, b, count)``.
    """
    out = np.zeros(len(t_ns), dtype=bool)
    places = np.flatnonzero(known)
    back = places[1:][np.diff(t_ns[places]) < 0]
    for place in back[:MOST_STEPS]:
        if not out[place]:
            begin, end = _block(
                int(place), np.flatnonzero(known[:place] & (t_ns[:place] == t_ns[place])), alike
            )
            out[begin:end] = True
    return out


def _block(place: int, before: NDArray[np.int64], alike: Callable[[int, int, int], bool]) -> tuple[int, int]:
    """Begin and end of the block about a place that is the same as the one before it; empty where there is none."""
    for earlier in before[::-1]:
        lag = place - int(earlier)
        if not alike(int(earlier), place, 1):
            continue
        begin = place if alike(int(earlier), place, lag) else _first_alike(place, lag, alike)
        if alike(begin - lag, begin, lag):
            return begin, begin + lag
    return place, place


def _first_alike(place: int, lag: int, alike: Callable[[int, int, int], bool]) -> int:
    """Where what is as ``lag`` records before begins: some that state no time may go before one that does."""
    begin = place
    while begin - lag > 0 and place - begin < lag and alike(begin - 1 - lag, begin - 1, 1):
        begin -= 1
    return begin


def said(twice: BoolArray, topic: str | None = None) -> list[Finding]:
    """What was left out, as findings."""
    count = int(twice.sum())
    text = f"{count} records stand there twice, a block after its like; counted once"
    return [Finding("duplicate", text, topic=topic, count=count)] if count else []
