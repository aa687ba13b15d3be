"""Zhao and Li 2021, table 2: parameters of the surge model.

python -m benchmarks.papers.p3_table2 [--seeds 5] [--quick]
"""

from __future__ import annotations

import numpy as np

from benchmarks.papers.p3 import NOISE, data, numbered, surge_only, true_numbers
from benchmarks.papers.report import row, spread

NAMES = ("a1", "a2", "a3", "a6", "a7")
PRINTED = {
    "paper: LS": (0.9953, -0.0060, -0.0388, 2.6357e-5, 5.6225e-4),
    "paper: ACO": (0.9972, -0.0051, -0.0227, 2.8218e-5, -2.8661e-6),
}


def main() -> None:
    seeds, methods, duration = surge_only(__doc__)
    row("", list(NAMES), 44)
    for name, values in PRINTED.items():
        row(name, [f"{x:.4g}" for x in values], 44)
    row("Skjetne et al. 2004", [f"{true_numbers()[k]:.4g}" for k in NAMES], 44)
    for noise in (0.0, NOISE):
        print(f"noise {noise} m/s and rad/s")
        for name, method in methods.items():
            draws = range(seeds if noise else 1)
            found = [numbered(method(data(noise, s, duration), s)) for s in draws]
            row(name, [spread(np.array([f[k] for f in found])) for k in NAMES], 44)


if __name__ == "__main__":
    main()
