"""Columns of one name: which is read as what."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from ingest.log import Finding
from ingest.tabular.naming import NAMESAKE


def namesakes(table: pd.DataFrame, topic: str) -> Iterator[Finding]:
    """A note on each name that several columns of a table have, naming them all."""
    names = [str(c) for c in table.columns]
    others = {n: [o for o in names if o != n and NAMESAKE.sub("", o) == n] for n in names}
    for name, more in others.items():
        if more:
            aside = " and ".join(f"'{o}'" for o in more)
            said = f"{len(more) + 1} columns are called '{name}': the first is read as that, the others as {aside}"
            yield Finding("note", said + _unlike(table, name, more), topic=topic)


def _unlike(table: pd.DataFrame, name: str, more: list[str]) -> str:
    """What tells them apart: that the first never changes and another does, or nothing at all."""
    if all(table[name].equals(table[o]) for o in more):
        return "; they are the same"
    moves = [len(table[n].unique()) > 1 for n in (name, *more)]
    return "; the first never changes" if any(moves) and not moves[0] else ""
