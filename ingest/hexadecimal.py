"""Hexadecimal digits in bytes, for compiled scanners."""

from __future__ import annotations

from ingest.compiled import compiled


@compiled
def hex_digit(c: int) -> int:  # pragma: no cover - compiled
    """Value of a hexadecimal digit, of either case; −1 for anything else."""
    if 48 <= c <= 57:
        return c - 48
    if 65 <= c <= 70:
        return c - 55
    if 97 <= c <= 102:
        return c - 87
    return -1
