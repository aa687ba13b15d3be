"""Places to work in that begin at a cache line: eight numbers abreast then never lie across two lines."""

from __future__ import annotations

import math
from itertools import accumulate

import numpy as np

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Bytes of a cache line, and of eight numbers abreast.
LINE = 64
ABREAST = LINE // 8


def zeros(*shape: int) -> FloatArray:
    """Zeros of a shape, in C order, beginning at a cache line."""
    count = math.prod(shape)
    room = np.zeros(count + ABREAST)
    skipped = (-room.ctypes.data % LINE) // 8
    return room[skipped : skipped + count].reshape(shape)


def places(*shapes: tuple[int, ...]) -> list[FloatArray]:
    """Zeros of several shapes, each in C order and beginning at a cache line, in one piece of memory."""
    counts = [math.prod(shape) for shape in shapes]
    ends = list(accumulate(-(-count // ABREAST) * ABREAST for count in counts))
    room = zeros(ends[-1])
    begins = (0, *ends[:-1])
    return [room[b : b + n].reshape(shape) for b, n, shape in zip(begins, counts, shapes, strict=True)]


def aligned(values: FloatArray) -> FloatArray:
    """A copy of an array that begins at a cache line."""
    out = zeros(*values.shape)
    out[...] = values
    return out
