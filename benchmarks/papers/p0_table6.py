"""Xie et al. 2020, table 6: prediction errors of KVLCC2, 30/30 zigzag, with samples lost at random.

python -m benchmarks.papers.p0_table6 [--seeds 5] [--quick]
"""

from __future__ import annotations

from benchmarks.papers.p0 import ALL_METHODS, Printed, clean, show, thinned
from benchmarks.papers.report import chosen_of, command_line

PRINTED: dict[float, Printed] = {
    0.1: {
        "ABEL": (4.61e-3, 7.36e-4, 2.86e-5),
        "BEL": (1.61e-2, 2.11e-3, 1.06e-4),
        "LSSVM": (2.62e-2, 1.86e-3, 2.00e-4),
    },
    0.2: {
        "ABEL": (1.42e-3, 4.47e-4, 4.15e-5),
        "BEL": (2.00e-3, 3.76e-4, 5.51e-5),
        "LSSVM": (5.49e-3, 2.03e-3, 1.85e-4),
    },
    0.3: {
        "ABEL": (2.87e-3, 9.30e-4, 5.37e-5),
        "BEL": (9.75e-3, 2.04e-3, 3.19e-4),
        "LSSVM": (6.38e-2, 3.12e-2, 3.18e-4),
    },
}


def main() -> None:
    chosen = command_line(__doc__)
    truth = clean(30.0, 60.0 if chosen.quick else 200.0)
    for share, printed in chosen_of(PRINTED, chosen):
        title = f"{share:.0%} of the samples lost"
        show(title, lambda s, p=share: thinned(truth, p, s), printed, chosen.seeds, methods=ALL_METHODS)


if __name__ == "__main__":
    main()
