"""File and entity names made from the names of logs."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from pathlib import PurePath


def tail(name: str, parts: int) -> str:
    """The last ``parts`` parts of a path, joined by underscores."""
    kept = [p for p in PurePath(name.replace("\\", "/")).parts if p.strip("/.")]
    return "_".join(kept[-parts:]) or "log"


def file_names(names: Iterable[str]) -> dict[str, str]:
    """A unique file name for each log: its own, with folders before it only where two logs share one."""
    wanted = list(dict.fromkeys(names))
    depth = dict.fromkeys(wanted, 1)
    for _ in range(max((len(PurePath(n).parts) for n in wanted), default=0)):
        count = Counter(tail(n, depth[n]) for n in wanted)
        for n in wanted:
            depth[n] += count[tail(n, depth[n])] > 1
    return _numbered({n: tail(n, depth[n]) for n in wanted})


def _numbered(names: dict[str, str]) -> dict[str, str]:
    """The same with a number before what is still not unique (``a_b`` and ``a/b``)."""
    count, seen, out = Counter(names.values()), Counter[str](), {}
    for key, value in names.items():
        seen[value] += 1
        out[key] = f"{seen[value]}_{value}" if count[value] > 1 else value
    return out


def slug(name: str) -> str:
    """A name that is safe in an entity path or an HTML id."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name).strip("_.") or "log"
