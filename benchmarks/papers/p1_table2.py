"""Zhu et al. 2019, table 2: the best C of the LS-SVR by cross-validation, PSO and ABC.

    python -m benchmarks.papers.p1_table2 [--seeds 5] [--quick]

The last lines say over which range of C the training error (eq. 16) is within 1 % of its least: inside it, what a
search finds says nothing of the ship.
"""

from __future__ import annotations

import numpy as np

from benchmarks.papers.p1 import CHANNELS, RANGE, Rows, differences, noisy, runs, searches, training_error
from benchmarks.papers.report import command_line, row, spread

PRINTED = {
    "paper: CV": (0.2318e7, 0.8968e9, 14.7966),
    "paper: PSO": (1.7492e7, 6.0e9, 19.7130),
    "paper: ABC": (4.3313e7, 9.9067e9, 0.1289),
}


def flat(rows: Rows) -> str:
    """Range of C where the training error is within 1 % of its least."""
    grid = np.logspace(*np.log10(RANGE), 49)
    error = training_error(rows)(grid[:, None])
    good = grid[error <= 1.01 * error.min() + 1e-30]
    return f"{good.min():.1e}..{good.max():.1e}"


def main() -> None:
    chosen = command_line(__doc__)
    training, _ = runs(120.0 if chosen.quick else 900.0)
    row("best C", list(CHANNELS), 34)
    for name, values in PRINTED.items():
        row(name, [f"{x:.3g}" for x in values], 34)
    for noise in (False, True):
        print("noise of 0.01 m/s and 0.01 deg/s" if noise else "no noise")
        cases = [
            [differences(noisy(training[c], s) if noise else training[c], c) for c in CHANNELS]
            for s in range(chosen.seeds)
        ]
        for name, search in searches(quick=chosen.quick).items():
            found = np.array([[search(rows, s) for rows in case] for s, case in enumerate(cases)])
            row(name, [spread(column, ".1e") for column in found.T], 34)
        row("as good as any", [flat(rows) for rows in cases[0]], 34)


if __name__ == "__main__":
    main()
