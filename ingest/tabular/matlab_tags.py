"""Whether the elements of a MATLAB 5 variable are what they say: a reader that trusts a wrong type reads beyond memory.

MAT-File Format, MathWorks 2022, chapter 1: every element has a tag of type and size, in eight bytes, or in four with up
to four bytes of data behind it; a matrix holds flags, dimensions and a name, then its parts or further matrices.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

#: Types of numbers and of text, and of a matrix and of what is compressed.
NUMBERS, TEXTS, MATRIX, COMPRESSED = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13}, {16, 17, 18}, 14, 15
#: Classes of arrays whose parts are matrices themselves: cells, structures, objects, function handles, opaque ones.
NESTED = {1, 2, 3, 16, 17}
#: Nothing that a person saves is nested deeper.
DEEPEST = 32


def sound(raw: bytes | memoryview, order: str, begin: int, depth: int = 0) -> bool:
    """Whether the variable whose tag is at ``begin`` holds elements of known types within its bounds.

    Parameters
    ----------
    raw : bytes
        The file, or the header and one variable.
    order : str
        ``<`` or ``>``.
    begin : int
        Of its tag.
    """
    kind, size = struct.unpack_from(f"{order}2I", raw, begin)
    if kind == COMPRESSED:  # its checksum tells
        return True
    if kind != MATRIX or begin + 8 + size > len(raw) or depth > DEEPEST:
        return False
    if size == 0:
        return True
    inner = list(_elements(raw, order, begin + 8, begin + 8 + size))
    if not inner or any(k not in NUMBERS | TEXTS | {MATRIX} for k, _ in inner):
        return False
    if inner[0][0] not in NUMBERS:
        return False
    nested = struct.unpack_from(f"{order}I", raw, inner[0][1])[0] & 0xFF in NESTED
    return all(
        sound(raw, order, at - 8, depth + 1) if k == MATRIX and nested else k != MATRIX for k, at in inner
    )


def _elements(raw: bytes | memoryview, order: str, p: int, end: int) -> Iterator[tuple[int, int]]:
    """Type of each element between two places and where its data are; type -1 where a tag or its data go beyond."""
    while p < end:
        if p + 8 > end:
            yield -1, p
            return
        kind, size = struct.unpack_from(f"{order}2I", raw, p)
        if kind >> 16:
            yield (kind & 0xFFFF if kind >> 16 <= 4 else -1), p + 4
            p += 8
            continue
        yield (kind if p + 8 + size <= end else -1), p + 8
        p += 8 + size + (-size % 8 if kind != COMPRESSED else 0)
