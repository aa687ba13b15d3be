"""Compiled code that is kept between runs, forgotten where any source of it has changed.

A function's machine code holds that of the functions which it calls, but is only made anew where its own file changed
(numba's cache looks no further): after an update in place, old and new code would be mixed.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path

from seatrial.stages import STAGES

#: Where the state of the sources is written down, beside the compiled code of the first stage.
NOTE = "compiled-from.txt"


def forget_stale_code(root: Path | None = None) -> int:
    """Remove compiled code that was made from other sources than are there now; the number of files removed.

    Parameters
    ----------
    root : Path, optional
        Folder that holds the stages; default: the one that holds ``seatrial``. Nothing is done where it may not be
        written to: numba then keeps its code elsewhere, and an installation anew makes all of it anew. What
        ``NUMBA_CACHE_DIR`` holds is its owner's.
    """
    root = root or Path(__file__).resolve().parents[1]
    note, removed = root / next(iter(STAGES)) / "__pycache__" / NOTE, 0
    with suppress(OSError):
        now = _state_of(root)
        if note.is_file() and note.read_text("ascii", "replace") == now:
            return 0
        for stage in STAGES:
            for file in (root / stage).rglob("__pycache__/*.nb[ci]"):
                file.unlink(missing_ok=True)
                removed += 1
        note.parent.mkdir(parents=True, exist_ok=True)
        note.write_text(now, "ascii")
    return removed


def _state_of(root: Path) -> str:
    """A digest of the sources' names, sizes and times."""
    files = sorted(p for stage in STAGES for p in (root / stage).rglob("*.py") if p.is_file())
    facts = [f"{p.relative_to(root)} {s.st_size} {s.st_mtime_ns}" for p in files for s in (p.stat(),)]
    return hashlib.sha256("\n".join(facts).encode()).hexdigest()
