"""Xie et al. 2020, table 7: prediction errors of Delfia 1*, 50/50 zigzag, with disturbances and with lost samples.

    python -m benchmarks.papers.p0_table7 [--seeds 5] [--quick]

The ship's forces are not published: a Delfia-like one stands for it, so that the numbers cannot agree, only the order
of the methods. Assumed: 0.3 m/s, 60 s at 0.1 s; C = 10 for the paper's three methods alike, on the columns that table
4 tells of (at f = 0.04 ABEL loses to LSSVM from C = 100 on: the less it is regularised, the more of what its observer
delays it takes for the ship's). The fitness of BEL at f = 0.04 is 1.45e-2; the paper prints 1.25e-2.
"""

from __future__ import annotations

from benchmarks.papers.azimuths import DELFIA, as_run
from benchmarks.papers.p0 import (
    AS_PRINTED,
    METHODS,
    Case,
    Method,
    Printed,
    as_printed,
    disturbed,
    in_degrees,
    lssvm_printed,
    scored,
    show,
    thinned,
)
from benchmarks.papers.report import chosen_of, command_line

DISTURBED: dict[float, Printed] = {
    0.01: {
        "ABEL": (8.60e-4, 2.34e-4, 4.42e-4),
        "BEL": (8.67e-4, 3.27e-4, 6.44e-4),
        "LSSVM": (1.27e-2, 5.96e-4, 4.00e-3),
    },
    0.04: {
        "ABEL": (9.76e-3, 8.89e-4, 4.54e-3),
        "BEL": (9.86e-3, 7.31e-4, 1.03e-2),
        "LSSVM": (7.51e-1, 4.38e-2, 3.40e-1),
    },
}
LOST: dict[float, Printed] = {
    0.1: {
        "ABEL": (5.77e-5, 2.82e-5, 5.27e-4),
        "BEL": (1.49e-4, 5.12e-5, 6.08e-4),
        "LSSVM": (1.72e-2, 1.14e-3, 7.09e-3),
    },
    0.4: {
        "ABEL": (1.87e-4, 1.47e-4, 1.98e-3),
        "BEL": (3.61e-4, 1.38e-4, 2.15e-3),
        "LSSVM": (6.22e-2, 1.27e-3, 1.62e-2),
    },
}

#: As table 4 has it, with one regularisation for all three.
SETTING = {**AS_PRINTED, "C": 10.0}
COMPARED = {
    **METHODS,
    "LSSVM as printed": Method(in_degrees(scored(lssvm_printed(SETTING), fixed=True))),
    "BEL as printed": Method(as_printed("bsas", SETTING), random=True),
    "ABEL as printed": Method(as_printed("absas", SETTING), random=True),
}


def main() -> None:
    chosen = command_line(__doc__)
    run = as_run(DELFIA.zigzag(50.0, 30.0 if chosen.quick else 60.0))
    truth = Case(run.t, run.states, run.delta, run, DELFIA.speed, DELFIA.length)
    for level, printed in chosen_of(DISTURBED, chosen):
        show(
            f"f = {level}", lambda s, f=level: disturbed(truth, f, s), printed, chosen.seeds, methods=COMPARED
        )
    for share, printed in chosen_of(LOST, chosen):
        show(
            f"{share:.0%} of the samples lost", lambda s, p=share: thinned(truth, p, s), printed, chosen.seeds,
            methods=COMPARED,
        )  # fmt: skip


if __name__ == "__main__":
    main()
