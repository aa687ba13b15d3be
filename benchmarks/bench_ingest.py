"""How fast logs are read, against the peers in the same run, and how much is recovered from damaged ones.

    python -m benchmarks.bench_ingest [--only tlog] [--scale 0.2] [--json FILE] [--no-damage] [--cold] [--files DIR]

``--cold`` adds the first read on a fresh machine, which compiles; ``--files`` what each log of a folder gave.

Times are processor time: ours the best of three after a first read (which may compile), the peer's of one.
Memory is the peak of what is allocated while reading over the size of the decoded columns.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.ingest_cases import Case, all_cases


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """Send what is written to the error stream, also by compiled code, nowhere."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        sys.stderr.flush()
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def timed(function: Callable[[Path], int], path: Path, times: int) -> tuple[float, int]:
    """Best time in seconds, and the count that the function returned."""
    best, count = float("inf"), 0
    for _ in range(times):
        begin = time.process_time()
        count = function(path)
        best = min(best, time.process_time() - begin)
    return best, count


def memory_ratio(path: Path) -> float:
    """Peak allocation of ``read_log`` over the size of its columns."""
    from ingest import read_log

    tracemalloc.start()
    log = read_log(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / max(1, sum(int(t.memory_usage(deep=False).sum()) for t in log.tables.values()))


def speed(case: Case, folder: Path, scale: float) -> dict[str, object]:
    """One row of the table of speeds."""
    path = case.make(folder, scale)
    case.ours(path)
    own, count = timed(case.ours, path, 3)
    peer, peer_count = timed(case.peer, path, 1)
    ratio = peer / own
    return {
        "log": case.name, "peer": case.peer_name, "MB": path.stat().st_size / 1e6, "records": count,
        "peer records": peer_count, "ours s": own, "peer s": peer, "ratio": ratio, "target": case.target,
        "reached": ratio >= case.target, "memory": memory_ratio(path),
    }  # fmt: skip


def flipped(records: list[bytes], rng: random.Random, spots: set[int]) -> list[bytes]:
    return [flip(r, rng) if i in spots else r for i, r in enumerate(records)]


def flip(record: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(record) * 2 // 3, len(record))
    return record[:at] + bytes([record[at] ^ (1 << rng.randrange(8))]) + record[at + 1 :]


def junk(records: list[bytes], rng: random.Random, spots: set[int]) -> list[bytes]:
    return [rng.randbytes(rng.randrange(1, 60)) + r if i in spots else r for i, r in enumerate(records)]


def lost(records: list[bytes], rng: random.Random, spots: set[int]) -> list[bytes]:
    return [r[: len(r) // 2] + r[len(r) // 2 + 6 :] if i in spots else r for i, r in enumerate(records)]


def cut(records: list[bytes], rng: random.Random, spots: set[int]) -> list[bytes]:
    return [*records[:-1], records[-1][:-3]]


#: Kind of damage, and whether it leaves the records at its spots intact.
DAMAGE = {"flipped": (flipped, False), "junk": (junk, True), "lost": (lost, False), "cut": (cut, False)}


def damage(case: Case, folder: Path, scale: float) -> list[dict[str, object]]:
    """Rows of the table of damage."""
    if case.records is None:
        return []
    path = case.make(folder, max(0.02, 0.05 * min(scale, 1.0)))
    head, *records = case.records(path.read_bytes())
    base = case.ours(path) - len(records)
    rows = []
    for kind, (apply, keeps) in DAMAGE.items():
        rng = random.Random(1)
        spots = {len(records) - 1} if kind == "cut" else set(rng.sample(range(1, len(records) - 1), 100))
        target = path.with_stem(f"damaged-{kind}")
        target.write_bytes(head + b"".join(apply(records, rng, spots)))
        intact = len(records) - (0 if keeps else len(spots))
        if kind == "flipped" and not case.checksummed:
            intact = len(records)
        own, other = (max(0, read(target) - base) for read in (case.ours, case.peer))
        rows.append({"log": case.name, "damage": kind, "intact": intact, "ours": own, "peer": other})
    return rows


COLD = """
import sys, time
begin = time.process_time()
from ingest import read_log
read_log(sys.argv[1])
first = time.process_time() - begin
begin = time.process_time()
read_log(sys.argv[1])
print(first, time.process_time() - begin)
"""


def cold(case: Case, folder: Path) -> dict[str, object]:
    """First read of a small log without compiled code on the disk, with it in a new process, and once more."""
    path = case.make(folder, 0.01)
    seconds = []
    with tempfile.TemporaryDirectory() as cache:
        for _ in range(2):
            seconds += subprocess.run(
                [sys.executable, "-c", COLD, str(path)], env={**os.environ, "NUMBA_CACHE_DIR": cache},
                cwd=Path(__file__).parents[1], capture_output=True, text=True, check=True,
            ).stdout.split()  # fmt: skip
    fresh, _, start, again = map(float, seconds)
    return {"log": case.name, "fresh machine s": fresh, "new process s": start, "again s": again}


def given(path: Path) -> dict[str, object]:
    """What one log gave."""
    from ingest import read_log

    log = read_log(path)
    read_log(path)
    begin = time.process_time()
    read_log(path)
    seconds = time.process_time() - begin
    noticed = sorted({f.kind for f in log.findings})
    return {
        "file": path.name, "format": log.format, "messages": log.messages, "topics": len(log.tables),
        "s": round(log.duration_s, 1), "UTC": "yes" if log.utc_ns is not None else "no",
        "damaged": log.bytes_damaged, "read in s": seconds, "found": " ".join(noticed) or "-",
        "quantities": " ".join(dict.fromkeys(s.quantity for s in log.sources)) or "-",
    }  # fmt: skip


def table(rows: list[dict[str, object]]) -> str:
    """Rows as aligned text."""
    if not rows:
        return ""
    cells = [[f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()] for row in rows]
    lines = [list(rows[0]), *cells]
    widths = [max(len(line[k]) for line in lines) for k in range(len(rows[0]))]
    return "\n".join("  ".join(c.rjust(w) for c, w in zip(line, widths, strict=True)) for line in lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", action="append", help="name of a case; may be given several times")
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--no-damage", action="store_true")
    parser.add_argument("--cold", action="store_true")
    parser.add_argument("--files", type=Path, metavar="DIR")
    options = parser.parse_args()
    cases = [c for c in all_cases() if not options.only or c.name in options.only]
    with tempfile.TemporaryDirectory() as folder, silent():
        speeds = [speed(c, Path(folder), options.scale) for c in cases]
        damages = (
            [] if options.no_damage else [r for c in cases for r in damage(c, Path(folder), options.scale)]
        )
        colds = [cold(c, Path(folder)) for c in cases] if options.cold else []
        files = [given(p) for p in sorted(options.files.iterdir())] if options.files else []
    print(*filter(None, map(table, (speeds, damages, colds, files))), sep="\n\n")
    if options.json:
        results = {"speed": speeds, "damage": damages, "cold": colds, "files": files}
        options.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
