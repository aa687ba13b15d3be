"""What the device that tells the time sends in one burst with it, and what it sends at other times.

A receiver sends all that it knows of one moment in one go, however long that takes. What of its own comes after a long
silence, in which other devices in the same stream went on, is of another moment: a compass under the receiver's name.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: A silence is long in which others send more than this share of what they send in all of an epoch, of so many records.
LONG, LEAST = 0.2, 4


def in_bursts(leader: Integers, kinds: Integers, own: Flags, stated: Flags) -> Flags:
    """Which records (n,) the device that tells the time sends in one burst with it.

    Parameters
    ----------
    leader : (e,) int64
        The first records of the epochs.
    kinds : (n,) int64
        Which records are of one kind.
    own : (n,) bool
        Which come from the device that tells the time.
    stated : (n,) bool
        Which state a time.
    """
    epoch = np.searchsorted(leader, np.arange(len(own)), side="right") - 1
    others = np.cumsum(~own)
    mine = np.flatnonzero(own & (epoch >= 0) & (epoch < len(leader) - 1))
    if not len(mine):
        return own
    silence = np.diff(others[mine], prepend=others[mine[0]])
    silence[np.isin(mine, leader)] = 0
    longest = pd.Series(silence).groupby(epoch[mine]).cummax().to_numpy(float)
    every = np.diff(others[leader])[epoch[mine]]
    share = pd.Series(np.where(every >= LEAST, longest / np.maximum(every, 1), 0.0))
    usual = share.groupby(kinds[mine]).median()
    aside = usual.index[usual.to_numpy() > LONG].to_numpy()
    return own & (stated | ~np.isin(kinds, aside))
