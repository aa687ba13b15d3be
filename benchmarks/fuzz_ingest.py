"""Damage logs at random and hold every reader to the check that the tests use, for as long as wanted.

    python -m benchmarks.fuzz_ingest --seconds 60 LOG...

Each log is read by the reader that recognises it, and every tenth time by any. The first failure ends the run
with its seed, which ``--seed`` repeats.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
import warnings
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from reader_checks import DAMAGE, check_log, log_of  # noqa: E402

from ingest.reader import Reader  # noqa: E402
from ingest.readers import READERS  # noqa: E402

LARGEST = 60_000


def reader_of(data: bytes) -> Reader:
    """Choose the reader that is surest of a log."""
    return max(READERS, key=lambda r: r.sniff(data[: 1 << 16]))


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Take a piece from the start of a log and damage it in one to four ways."""
    out = data[: rng.randrange(50, LARGEST)]
    for _ in range(rng.randrange(1, 5)):
        out = rng.choice(list(DAMAGE.values()))(out, rng) or b"\0"
    return out[: 4 * LARGEST]


def attempt(path: Path, data: bytes, seed: int) -> str:
    """One damaged copy through one reader; which."""
    rng = random.Random(seed)
    reader = rng.choice(READERS) if seed % 10 == 0 else reader_of(data)
    copy = damaged(data, rng)
    log = log_of(reader, copy, path)
    if log is not None and log.tables:
        check_log(log, len(copy))
    return reader.name


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("logs", nargs="+", type=Path)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    warnings.simplefilter("error")
    logs = [(p, p.read_bytes()) for p in options.logs]
    begin, seed, slowest = time.monotonic(), options.seed, (0.0, "", 0)
    while time.monotonic() - begin < options.seconds:
        path, data = logs[seed % len(logs)]
        start = time.monotonic()
        try:
            name = attempt(path, data, seed)
        except Exception:
            print(
                f"failed: --seed {seed} on {path}, number {seed % len(logs)} of {len(logs)}", file=sys.stderr
            )
            raise
        slowest = max(slowest, (time.monotonic() - start, name, seed))
        seed += 1
    print(
        f"{seed - options.seed} copies; the slowest took {slowest[0]:.2f} s ({slowest[1]}, seed {slowest[2]})"
    )


if __name__ == "__main__":
    main()
