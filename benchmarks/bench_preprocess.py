"""Preprocessing, measured: accuracy beside other methods, noise levels, outliers, clocks, and time.

``python -m benchmarks.bench_preprocess [--seeds N] [--only PART …] [--vessels NAME …]`` prints one table after another.
The truth is simulated; each method gets the same samples. "given" is the same smoother with the true noise levels and
the true outliers set aside; "given, plain" a Kalman/RTS smoother in earth axes with the same.
"""

from __future__ import annotations

import argparse

from benchmarks import preprocess_real
from benchmarks.preprocess_accuracy import accelerations, accuracy, levels_by_rate, outliers_and_levels
from benchmarks.preprocess_cases import CASES, INERTIAL, SAILED
from benchmarks.preprocess_clocks import clocks
from benchmarks.preprocess_time import timing
from benchmarks.preprocess_wanders import wanders

PARTS = ("time", "accuracy", "accelerations", "outliers", "levels", "wanders", "clocks", "measured")


def measure(part: str, seeds: int, vessels: list[str]) -> None:
    """Print one part, of some vessels only where any are named."""
    cases = [c for c in CASES if not vessels or c[0] in vessels]
    sailed = [c for c in SAILED if not vessels or c[0] in vessels]
    todo = {
        "time": timing,
        "accuracy": lambda: accuracy(seeds, cases),
        "accelerations": lambda: accelerations(
            seeds, [c for c in INERTIAL if not vessels or c[0] in vessels]
        ),
        "outliers": lambda: outliers_and_levels(seeds, cases),
        "levels": lambda: levels_by_rate(seeds, sailed),
        "wanders": lambda: wanders(max(seeds // 2, 1), sailed),
        "clocks": lambda: clocks(2 * seeds, sailed),
        "measured": preprocess_real.measured,
    }
    todo[part]()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--vessels", nargs="+", default=[], help="of the simulated ones, only these")
    options = parser.parse_args()
    for part in options.only:
        measure(part, 1 if options.quick else options.seeds, options.vessels)


if __name__ == "__main__":
    main()
