"""Markdown of the reference: tables, cells, code."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """A Markdown table."""
    lines = [list(head), ["---"] * len(head), *([cell(c) for c in row] for row in rows)]
    return [f"| {' | '.join(line)} |" for line in lines] + [""]


def cell(value: object) -> str:
    """Text of one cell: on one line, with its bars told from those of the table."""
    return re.sub(r"\s+", " ", "" if value is None else str(value)).replace("|", "\\|").strip()


def code(text: object) -> str:
    """Text as code, empty where there is none."""
    return f"`{text}`" if text not in (None, "") else ""
