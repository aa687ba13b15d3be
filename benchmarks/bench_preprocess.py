"""Preprocessing, measured: accuracy beside other methods, noise levels, outliers, clocks, and time.

``python -m benchmarks.bench_preprocess [--seeds N] [--only PART …]`` prints one table after another. The truth is
simulated; each method gets the same samples. "given" is the same smoother with the true noise levels and the true
outliers set aside; "given, plain" a Kalman/RTS smoother in earth axes with the same.
"""

from __future__ import annotations

import argparse

from benchmarks import preprocess_real
from benchmarks.preprocess_accuracy import accuracy, levels_by_rate, outliers_and_levels
from benchmarks.preprocess_clocks import clocks
from benchmarks.preprocess_time import timing
from benchmarks.preprocess_wanders import wanders

PARTS = {
    "time": lambda seeds: timing(),
    "accuracy": accuracy,
    "outliers": outliers_and_levels,
    "levels": lambda seeds: levels_by_rate(max(seeds // 3, 1)),
    "wanders": lambda seeds: wanders(max(seeds // 2, 1)),
    "clocks": lambda seeds: clocks(2 * seeds),
    "measured": lambda seeds: preprocess_real.measured(),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", nargs="+", choices=list(PARTS), default=list(PARTS))
    options = parser.parse_args()
    for name in options.only:
        PARTS[name](1 if options.quick else options.seeds)


if __name__ == "__main__":
    main()
