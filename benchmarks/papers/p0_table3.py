"""Xie et al. 2020, table 3: prediction errors of KVLCC2 without disturbances.

python -m benchmarks.papers.p0_table3 [--seeds 5] [--quick]
"""

from __future__ import annotations

from benchmarks.papers.p0 import ALL_METHODS, Printed, clean, show
from benchmarks.papers.report import chosen_of, command_line

PRINTED: dict[float, Printed] = {
    10.0: {
        "ABEL": (1.16e-3, 3.34e-4, 1.77e-5),
        "BEL": (1.93e-3, 2.83e-4, 2.06e-5),
        "LSSVM": (3.46e-3, 4.81e-4, 3.37e-5),
    },
    20.0: {
        "ABEL": (1.19e-3, 4.09e-4, 2.40e-5),
        "BEL": (2.02e-3, 5.06e-4, 5.30e-5),
        "LSSVM": (9.63e-3, 7.15e-4, 3.32e-5),
    },
    30.0: {
        "ABEL": (1.63e-3, 4.23e-4, 7.89e-6),
        "BEL": (1.78e-3, 4.36e-4, 1.77e-5),
        "LSSVM": (9.95e-3, 1.39e-3, 1.60e-5),
    },
}


def main() -> None:
    chosen = command_line(__doc__)
    duration = 60.0 if chosen.quick else 200.0
    for angle, printed in chosen_of(PRINTED, chosen):
        title = f"zigzag {angle:.0f}/{angle:.0f}"
        show(title, lambda _, a=angle: clean(a, duration), printed, chosen.seeds, methods=ALL_METHODS)


if __name__ == "__main__":
    main()
