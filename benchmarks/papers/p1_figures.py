"""Zhu et al. 2019, figures 6-12: time, error and parameters against the number of samples, container ship.

    python -m benchmarks.papers.p1_figures [--quick]

MSE of the acceleration over the validation run. "one filter" sees both sides of the equation through one observer of
0.2 rad/s, with C = 1e10. The paper reads off 350, 630 and 230 samples as enough for surge, sway and yaw.
"""

from __future__ import annotations

import numpy as np

from benchmarks.papers.p1 import (
    CHANNELS,
    NAMES,
    RANGE,
    Rows,
    differences,
    filtered,
    fitted,
    runs,
    searches,
    timed,
)
from benchmarks.papers.report import command_line, row
from identify.estimators.estimate import FloatArray

COUNTS = (50, 100, 230, 350, 630, 900, 1799)
ENOUGH = {"surge": 350, "sway": 630, "yaw": 230}


def error(theta: FloatArray, rows: Rows) -> float:
    """MSE of the acceleration, the bias left out as eq. 27 has none."""
    return float(np.mean((rows.target - rows.design @ theta) ** 2))


def main() -> None:
    chosen = command_line(__doc__, seeds=1)
    training, validation = runs(120.0 if chosen.quick else 900.0)
    counts = (50, 100, 230) if chosen.quick else COUNTS
    for channel in CHANNELS:
        rows, held = differences(training[channel], channel), differences(validation[channel], channel)
        row(
            f"\n{channel} (paper: {ENOUGH[channel]} suffice)",
            ["samples", "time s", "C", "MSE", *NAMES[channel]],
            12,
            34,
        )
        for count in counts:
            for name, search in searches(quick=chosen.quick).items():
                c, seconds = timed(search, rows.first(count), 0)
                theta = fitted(rows.first(count), c)
                cells = [
                    f"{seconds:.2f}",
                    f"{c:.1e}",
                    f"{error(theta, held):.2e}",
                    *(f"{x:.4g}" for x in theta),
                ]
                row(f"{name}-LSSVR", [str(count), *cells], 12, 34)
            theta = fitted(filtered(training[channel], channel).first(count), RANGE[1])
            cells = ["", "1.0e+10", f"{error(theta, held):.2e}", *(f"{x:.4g}" for x in theta)]
            row("one filter", [str(count), *cells], 12, 34)


if __name__ == "__main__":
    main()
