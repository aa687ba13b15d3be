"""Xie et al. 2020, table 5: prediction errors of KVLCC2, 30/30 zigzag, with disturbances.

The column f = 0.02 of the paper is a copy of table 3's 20/20 and is left out.

python -m benchmarks.papers.p0_table5 [--seeds 5] [--quick]
"""

from __future__ import annotations

from benchmarks.papers.p0 import ALL_METHODS, Printed, clean, disturbed, show
from benchmarks.papers.report import chosen_of, command_line

PRINTED: dict[float, Printed] = {
    0.01: {
        "ABEL": (2.87e-3, 5.55e-4, 1.71e-5),
        "BEL": (3.69e-3, 6.93e-4, 2.46e-5),
        "LSSVM": (1.77e-2, 1.33e-3, 1.35e-4),
    },
    0.03: {
        "ABEL": (4.51e-3, 6.15e-4, 7.15e-5),
        "BEL": (1.00e-2, 2.81e-3, 4.54e-4),
        "LSSVM": (4.85e-2, 1.32e-3, 2.04e-4),
    },
}


def main() -> None:
    chosen = command_line(__doc__)
    truth = clean(30.0, 60.0 if chosen.quick else 200.0)
    for level, printed in chosen_of(PRINTED, chosen):
        show(
            f"f = {level}",
            lambda s, f=level: disturbed(truth, f, s),
            printed,
            chosen.seeds,
            methods=ALL_METHODS,
        )


if __name__ == "__main__":
    main()
