"""Damaged stretches of a file as findings."""

from __future__ import annotations

from collections.abc import Sequence

from ingest.log import Finding

#: More stretches than this become one finding: a file of noise must not become a million objects.
MOST = 1000


def damage_findings(
    spans: Sequence[tuple[int, int]], size: int, what: str = "no record"
) -> tuple[Finding, ...]:
    """One finding per damaged stretch.

    Parameters
    ----------
    spans : sequence of (int, int)
        Offset and length of each stretch, in order.
    size : int
        Of the file: a stretch that reaches its end is a truncation.
    what : str
        What is wrong with it.
    """
    told = [damage(offset, length, size, what) for offset, length in spans[:MOST]]
    rest = spans[MOST:]
    if rest:
        offset, length = rest[0][0], rest[-1][0] + rest[-1][1] - rest[0][0]
        message = f"{len(rest)} more damaged stretches from here on"
        told.append(Finding("damaged", message, offset, length, count=len(rest)))
    return tuple(told)


def damage(offset: int, length: int, size: int, what: str) -> Finding:
    """The finding for one stretch."""
    if offset + length >= size:
        return Finding("truncated", "the file ends within a record", offset, length)
    return Finding("damaged", f"{length} bytes that are {what}", offset, length)


def merged(spans: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Stretches in order of offset, those that touch joined."""
    out: list[tuple[int, int]] = []
    for offset, length in sorted(spans):
        if out and offset <= out[-1][0] + out[-1][1]:
            start = out[-1][0]
            out[-1] = (start, max(out[-1][1], offset + length - start))
        else:
            out.append((offset, length))
    return out
