"""``python -m benchmarks.blind``: draw blind cases, diagnose them, and print how well that went."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from benchmarks.blind.case import line_of
from benchmarks.blind.detail import told
from benchmarks.blind.scores import Record
from benchmarks.blind.tables import each, summary
from benchmarks.blind.workers import Task, run_cases

KINDS = ("all", "clean", "one", "two", "outside")


def parser() -> argparse.ArgumentParser:
    """Return the command line."""
    p = argparse.ArgumentParser(prog="python -m benchmarks.blind", description=__doc__)
    p.add_argument("--cases", type=int, default=60)
    p.add_argument("--seed", type=int, default=None, help="of the first case (default: drawn, and printed)")
    p.add_argument("--kind", choices=KINDS, default="all")
    p.add_argument("--workers", type=int, default=2)
    p.add_argument("--limit", type=float, default=120.0, help="seconds for one diagnosis")
    p.add_argument("--keep", type=Path, help="keep the campaigns' files in this folder")
    p.add_argument(
        "--out", type=Path, help="results, one JSON line per case; a run that was broken off goes on"
    )
    p.add_argument("--no-oracle", action="store_true", help="quicker, but nothing is known of detectability")
    p.add_argument("--show", type=int, metavar="SEED", help="one case in detail")
    p.add_argument("--print", type=Path, nargs="+", metavar="RESULTS", help="only print what such files hold")
    return p


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark."""
    a = parser().parse_args(arguments)
    if a.print:
        show_stored([r for path in a.print for r in read_records(path)], a.show)
        return
    kind = None if a.kind == "all" else a.kind
    seed = a.show if a.show is not None else _seed(a.seed)
    seeds = [seed] if a.show is not None else range(seed, seed + a.cases)
    old = read_records(a.out) if a.out and a.show is None else []
    known = {(r["seed"], r["asked"]) for r in old}
    tasks = [Task(s, kind, a.keep, not a.no_oracle) for s in seeds if (s, a.kind) not in known]
    records = list(old)
    for record in run_cases(tasks, a.workers, a.limit):
        records.append(record)
        print(told(record) if a.show is not None else each(record), flush=True)
        if a.out and a.show is None:
            with a.out.open("a", encoding="utf-8") as file:
                file.write(line_of(record) + "\n")
    if a.show is None:
        show_summary(records)


def _seed(given: int | None) -> int:
    """Draw a seed where none is given."""
    if given is not None:
        return given
    import secrets

    seed = secrets.randbelow(900_000_000) + 1000
    print(f"seed {seed}")
    return seed


def read_records(path: Path) -> list[Record]:
    """Return the records of a file, if it is there; the last of each case counts."""
    if not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").splitlines()
    return list({(r["seed"], r["asked"]): r for r in map(json.loads, lines)}.values())


def show_stored(records: Sequence[Record], seed: int | None) -> None:
    """Print what is stored: one case, or all tables."""
    if seed is None:
        show_summary(records)
    for record in records:
        if record["seed"] == seed:
            print(told(record))


def show_summary(records: Sequence[Record]) -> None:
    """Print all tables."""
    print(f"\n{len(records)} cases\n\n{summary(records)}")


if __name__ == "__main__":
    main()
