"""Xie et al. 2020, table 8: prediction errors on the tug model Tito Neri, a zigzag and three runs steered at random.

    python -m benchmarks.papers.p0_table8 [--seeds 5] [--quick]

The measured data are not published: a Tito-Neri-like ship stands for them, so that the numbers cannot agree. Assumed:
0.65 m/s, 90 s at 0.1 s, white noise of 0.03 m/s (u, v from satellite positions) and 0.02 rad/s, each run identified by
itself as in the rest of the paper. The fitness is that of the table: sum of the roots of u, v and L r.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.papers.azimuths import TITO_NERI, as_run, random_steering
from benchmarks.papers.p0 import Case, Printed, fitness_of_roots, show
from benchmarks.papers.record import Record
from benchmarks.papers.report import chosen_of, command_line

PRINTED: dict[str, Printed] = {
    "zigzag": {"ABEL": (1.93e-2, 4.33e-3, 3.05e-3), "LSSVM": (1.97e-2, 8.71e-3, 1.81e-2)},
    "sample 1": {"ABEL": (7.76e-2, 2.27e-2, 1.84e-2), "LSSVM": (1.62e3, 3.33e12, 1.03e13)},
    "sample 2": {"ABEL": (2.13e-2, 1.01e-2, 2.21e-3), "LSSVM": (7.70e-2, 6.20e-3, 9.64e-3)},
    "sample 3": {"ABEL": (1.86e-2, 1.93e-2, 1.05e-2), "LSSVM": (2.32e-2, 6.09e-2, 2.24e-2)},
}
NOISE = np.array([0.03, 0.03, 0.02])


def measured(record: Record, seed: int) -> Case:
    """A run with the noise of satellite and inertial sensors."""
    run = as_run(record)
    noise = NOISE * np.random.default_rng(seed).standard_normal(record.states.shape)
    case = Case(run.t, run.states, run.delta, run, TITO_NERI.speed, TITO_NERI.length)
    return replace(case, states=run.states + noise)


def main() -> None:
    chosen = command_line(__doc__)
    duration = 30.0 if chosen.quick else 90.0
    runs = [TITO_NERI.zigzag(20.0, duration), *(random_steering(TITO_NERI, duration, k) for k in (1, 2, 3))]
    for (title, printed), record in zip(chosen_of(PRINTED, chosen), runs, strict=False):
        show(title, lambda s, r=record: measured(r, s), printed, chosen.seeds, fitness_of_roots)


if __name__ == "__main__":
    main()
