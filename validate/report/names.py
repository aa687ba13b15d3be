"""File and entity names made from the names of logs."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from pathlib import PurePath

#: A name of more letters is long.
LONG = 18


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


def shared_begin(names: Iterable[str]) -> int:
    """How many letters all names begin with alike, up to the end of a word; 0 for one name."""
    found = sorted(set(names))
    if len(found) < 2:
        return 0
    first, last = found[0], found[-1]
    alike = next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), len(first))
    return max(first.rfind(mark, 0, alike) + 1 for mark in "_-. /")


def short_names(names: Iterable[str]) -> dict[str, str]:
    """Each name as it is shown: where some are long, without what all of them begin with."""
    wanted = list(dict.fromkeys(names))
    cut = shared_begin(wanted) if max(map(len, wanted), default=0) > LONG else 0
    return {name: f"…{name[cut:]}" if cut > 3 else name for name in wanted}


def slug(name: str) -> str:
    """A name that is safe in an entity path or an HTML id."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name).strip("_.") or "log"
