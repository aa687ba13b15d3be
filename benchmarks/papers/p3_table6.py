"""Zhao and Li 2021, table 6: R² of the whole model's free run, on the zigzag and on two other runs.

python -m benchmarks.papers.p3_table6 [--seeds 5] [--quick]
"""

from __future__ import annotations

import numpy as np

from benchmarks.papers.cybership import rudder_levels, rudder_prbs, sensed, zigzag_training
from benchmarks.papers.library import free_run, r_squared
from benchmarks.papers.p3 import NOISE, data, options
from benchmarks.papers.report import row, spread

PRINTED = {
    "zigzag 20/20": {"paper: LS": (0.9890, 0.9957, 0.9952), "paper: ACO": (0.8478, 0.9182, 0.9417)},
    "rudder at random": {"paper: LS": (0.9106, 0.9458, 0.9740), "paper: ACO": (0.9476, 0.9672, 0.9831)},
    "constant inputs": {"paper: LS": (0.7050, -np.inf, -np.inf), "paper: ACO": (0.9526, 0.9745, 0.9784)},
}


def main() -> None:
    seeds, methods, duration = options(__doc__)
    runs = dict(zip(PRINTED, (zigzag_training(), rudder_prbs(), rudder_levels()), strict=True))
    for noise in (0.0, NOISE):
        found = {
            name: [method(data(noise, s, duration), s) for s in range(seeds if noise else 1)]
            for name, method in methods.items()
        }
        print(f"\nnoise {noise} m/s and rad/s")
        for title, run in runs.items():
            row(title, ["R² of u", "of v", "of r"], 30)
            for name, values in PRINTED[title].items():
                row(name, [f"{x:.4f}" for x in values], 30)
            for name, fits in found.items():
                scores = np.array([r_squared(free_run(f, run, sensed(NOISE)), run.states) for f in fits])
                row(name, [spread(column, ".4f") for column in scores.T], 30)


if __name__ == "__main__":
    main()
