"""Zhao and Li 2021, table 3: R² of the surge model's free run, on its training and on two other runs.

python -m benchmarks.papers.p3_table3 [--seeds 5] [--quick]
"""

from __future__ import annotations

import numpy as np

from benchmarks.papers.cybership import sensed, surge_levels, surge_prbs, surge_training
from benchmarks.papers.library import free_run, r_squared
from benchmarks.papers.p3 import NOISE, data, straightened, surge_only
from benchmarks.papers.report import row, spread

PRINTED = {"paper: LS": (0.9953, 0.9959, 0.9908), "paper: ACO": (0.9959, 0.9982, 0.9934)}


def main() -> None:
    seeds, methods, duration = surge_only(__doc__)
    runs = (straightened(surge_training()), surge_prbs(), surge_levels())
    row("R² of u", ["training", "validation 1", "validation 2"], 26)
    for name, values in PRINTED.items():
        row(name, [f"{x:.4f}" for x in values], 26)
    for noise in (0.0, NOISE):
        print(f"noise {noise} m/s and rad/s")
        for name, method in methods.items():
            found = [method(data(noise, s, duration), s) for s in range(seeds if noise else 1)]
            scores = np.array(
                [[r_squared(free_run(f, r, sensed(NOISE)), r.states)[0] for r in runs] for f in found]
            )
            row(name, [spread(column, ".4f") for column in scores.T], 26)


if __name__ == "__main__":
    main()
