"""Places to work in that begin at a cache line: eight numbers abreast then never lie across two lines."""

from __future__ import annotations

import math

import numpy as np

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Bytes of a cache line, and of eight numbers abreast.
LINE = 64


def zeros(*shape: int) -> FloatArray:
    """Zeros of a shape, in C order, beginning at a cache line."""
    count = math.prod(shape)
    room = np.zeros(count + LINE // 8)
    skipped = (-room.ctypes.data % LINE) // 8
    return room[skipped : skipped + count].reshape(shape)


def aligned(values: FloatArray) -> FloatArray:
    """A copy of an array that begins at a cache line."""
    out = zeros(*values.shape)
    out[...] = values
    return out
