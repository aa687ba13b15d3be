"""``python -m benchmarks.bench_first_call``: what the first call of a new installation costs, and the second.

Every task runs in a process of its own, first with nothing compiled, then with what the first left on the disk: one log
of 100 s identified (`import` to the parameters' covariance), and `seatrial demo`. Processor and clock seconds; on a
machine that does other things too, look at the former.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TASKS = {
    "one fit": ["-m", "benchmarks.bench_first_call", "--fit"],
    "seatrial demo": ["-m", "seatrial", "demo", "--quiet", "--out", "demo"],
}


def fit() -> None:
    """Identify one log."""
    from benchmarks.papers.library import identify, trial_of
    from benchmarks.papers.p1_outliers import RATE, SENSED, record_of
    from benchmarks.papers.p1_table4 import measured, zigzag

    table = measured(zigzag(10.0, 100, hertz=RATE), seed=0, share=0.0)
    identify([trial_of("zigzag", record_of(table), SENSED)], "zhu2019").fit  # noqa: B018 - made when asked for


def timed(words: list[str], folder: str) -> tuple[float, float]:
    """Processor and clock seconds of Python with these words, its compiled code kept in ``folder``."""
    root = str(Path(__file__).parents[1])
    environment = {**os.environ, "NUMBA_CACHE_DIR": folder, "PYTHONPATH": root, "OPENBLAS_NUM_THREADS": "1"}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime, time.perf_counter()
    subprocess.run([sys.executable, *words], env=environment, cwd=folder, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--fit", action="store_true", help="identify one log in this process, and no more")
    if parser.parse_args().fit:
        fit()
        return
    for name, words in TASKS.items():
        with tempfile.TemporaryDirectory() as folder:
            for which in ("first", "second"):
                processor, clock = timed(words, folder)
                print(f"{name:14} {which:7} processor {processor:6.1f} s, clock {clock:6.1f} s", flush=True)


if __name__ == "__main__":
    main()
